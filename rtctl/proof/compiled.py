"""Compilation of the true machine with a cache on disk, keyed by all its sources.

Numba checks only the file of a cached function, and would run an old equation after a change in another file.
"""

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from numba import njit

SOURCES = ("machine", "law", "forces", "solver")


def compiler(sources: Iterable[Path]) -> Callable[[Callable[..., Any]], Any]:
    """Compiling decorator: IEEE arithmetic in program order, no GIL, cached until one of `sources` changes."""
    key = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:10]

    def compiled(function: Callable[..., Any]) -> Any:
        function.__qualname__ = f"{function.__name__}_{key}"
        return njit(cache=True, error_model="numpy", nogil=True)(function)

    return compiled


compiled = compiler(Path(__file__).with_name(f"{n}.py") for n in SOURCES)
