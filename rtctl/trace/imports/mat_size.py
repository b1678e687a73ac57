"""Unpacked size of a MATLAB file of version 4 or 5, from the tags of its variables."""

import zlib
from pathlib import Path
from typing import IO

from scipy.io import whosmat

from rtctl.trace.imports.limits import refuse_large

HEADER = 128  # bytes before the first variable
COMPRESSED = 15  # element type
PROBE = 4096  # compressed bytes that hold at least the first tag
WIDTHS = {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "single": 4, "logical": 1, "char": 4}


def check_size(path: Path) -> None:
    """Raise UserError where the variables exceed the memory limit. Other errors mean a damaged file."""
    try:
        variables = whosmat(path)
    except TypeError:  # a MATLAB object has no shape
        variables = []
    size = 0
    for _, shape, kind in variables:
        count = 1
        for length in shape:
            count *= max(int(length), 0)
        size += 0 if kind == "sparse" else count * WIDTHS.get(kind, 8)
    refuse_large(path, size, "its variables")
    with path.open("rb") as file:
        refuse_large(path, _unpacked(file), "its variables")


def _unpacked(file: IO[bytes]) -> int:
    """Unpacked bytes of all variables of a version 5 file; 0 for another version."""
    head = file.read(HEADER)
    order = {b"IM": "little", b"MI": "big"}.get(head[126:128])
    if order is None or not all(head[:4]):
        return 0
    size = 0
    while len(tag := file.read(8)) == 8:
        kind, count = (int.from_bytes(tag[k : k + 4], order) for k in (0, 4))  # type: ignore[arg-type]
        if kind == COMPRESSED:
            packed = file.read(min(count, PROBE))
            inner = zlib.decompressobj().decompress(packed, 8)
            size += int.from_bytes(inner[4:8], order)  # type: ignore[arg-type]
            file.seek(count - len(packed), 1)
        else:
            size += count
            file.seek(count, 1)
    return size
