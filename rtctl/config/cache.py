"""Where rtctl keeps what it can make again: compiled ticks, and the words that the shell completes."""

import os
from pathlib import Path

import platformdirs


def cache_folder() -> Path:
    """$RTCTL_CACHE_DIR, or the user's cache folder. Never the folder of the program, which may be read-only."""
    given = os.environ.get("RTCTL_CACHE_DIR")
    return Path(given) if given else Path(platformdirs.user_cache_dir("rtctl"))
