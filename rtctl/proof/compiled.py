"""Compile the true machine once and keep it on disk, under a name made of every source that goes into it.

Numba looks at the file of a cached function alone, and would run an old equation after a change in another file.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

SOURCES = ("machine", "law", "forces", "solver")
KEY = hashlib.sha256(b"".join(Path(__file__).with_name(f"{n}.py").read_bytes() for n in SOURCES)).hexdigest()[:10]


def compiled(function: Callable[..., Any]) -> Any:
    """IEEE arithmetic in program order, no Python lock, kept in the cache."""
    function.__qualname__ = f"{function.__name__}_{KEY}"
    return njit(cache=True, error_model="numpy", nogil=True)(function)
