"""Foxglove server of a running machine: rows, status and events as channels, settings as parameters."""
