"""rtctl: a real-time controller daemon for motion hardware, with an emulated twin."""

__version__ = "0.1.0"
