"""A running machine in Foxglove: its rows, status and events as channels, its settings as parameters."""
