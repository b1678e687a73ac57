"""Reader of gzip, bzip2 and xz files, detected by first bytes and unpacked into a private folder up to the limit."""

import bz2
import gzip
import lzma
import shutil
import tempfile
import weakref
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import limit, refuse_large
from rtctl.trace.imports.table import Table

OPENERS: dict[bytes, tuple[str, Any]] = {
    b"\x1f\x8b": ("gzip", gzip.open),
    b"BZh": ("bzip2", bz2.open),
    b"\xfd7zXZ\x00": ("xz", lzma.open),
}
SUFFIXES = (".gz", ".gzip", ".bz2", ".xz")
PIECE = 1 << 20


class _Folder:
    """Private folder, deleted with its last reference."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="rtctl-import-"))
        weakref.finalize(self, shutil.rmtree, self.path, True)


def packing(head: bytes) -> str:
    """Compression of a file with these first bytes; "" without compression."""
    return next((name for magic, (name, _) in OPENERS.items() if head.startswith(magic)), "")


def read_packed(path: Path, read: Callable[[Path], Table]) -> Table:
    """Table of the unpacked file, read by `read`. Raises UserError, OSError."""
    with path.open("rb") as file:
        head = file.read(8)
    kind, opener = next(found for magic, found in OPENERS.items() if head.startswith(magic))
    folder = _Folder()
    inner = folder.path / (path.stem if path.suffix.lower() in SUFFIXES else path.name)
    try:
        with opener(path, "rb") as source, inner.open("wb") as out:
            _copy(path, source, out)
    except (EOFError, zlib.error, lzma.LZMAError, gzip.BadGzipFile, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise UserError(f"{path}: the {kind} file is damaged or cut off; pack it again") from None
    try:
        table = read(inner)
    except UserError as error:
        raise type(error)(str(error).replace(str(inner), str(path))) from None

    def where(row: int, kept: _Folder = folder) -> str:
        return table.where(row)  # reads line numbers from the unpacked file, kept as long as the table

    return table._replace(path=path, where=where)


def _copy(path: Path, source: IO[bytes], out: IO[bytes]) -> None:
    size = 0
    while piece := source.read(PIECE):
        size += len(piece)
        if size > limit():
            refuse_large(path, size, "its unpacked bytes, and more,")
        out.write(piece)
    shutil.copystat(path, out.name)
