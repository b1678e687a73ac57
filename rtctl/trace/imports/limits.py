"""Memory limit for a foreign file, checked by the size declared in the file before unpacking."""

import os
from pathlib import Path

from rtctl.config.errors import UserError

VARIABLE = "RTCTL_IMPORT_GIB"
DEFAULT = 2.0  # GiB of columns, unpacked; 2.7e8 numbers of 8 bytes


def limit() -> int:
    """Limit in bytes for the columns of one file. Raises UserError where the environment variable is no number."""
    text = os.environ.get(VARIABLE, "")
    try:
        gib = float(text) if text else DEFAULT
    except ValueError:
        gib = -1.0
    if not 0.0 < gib < float("inf"):
        raise UserError(f"{VARIABLE}={text}: it should be a number of GiB, such as 4")
    return int(gib * 2**30)


def refuse_large(path: Path, size: float, what: str = "its columns") -> None:
    """Raise UserError where `size` bytes of `what` exceed the limit."""
    if size > limit():
        raise UserError(
            f"{path}: {what} take {readable(size)} in memory and {readable(limit())} are taken at most; write a "
            f"shorter part or fewer columns, or set {VARIABLE} to the GiB that it may take"
        )


def readable(size: float) -> str:
    """Text of a size in bytes: 4.1 GiB, 30 MiB."""
    return f"{size / 2**30:.3g} GiB" if size >= 2**30 else f"{size / 2**20:.3g} MiB"
