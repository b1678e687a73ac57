"""Recordings of other programs as bundles: readers, one file here for each kind, and what makes a bundle of them."""

import importlib
from pathlib import Path

from rtctl.config.errors import UserError, nearest
from rtctl.trace.imports.table import Table

__all__ = ["READERS", "Table", "read"]

READERS = {  # how the name ends -> module here
    ".csv": "csv_file",
    ".tsv": "csv_file",
    ".txt": "csv_file",
    ".mat": "mat_file",
    ".npz": "npz_file",
    ".parquet": "parquet_file",
    ".mcap": "mcap_file",
}


def read(path: Path | str) -> Table:
    """All columns of a file, into memory. Raises UserError where it cannot be read, or its kind is not known."""
    path = Path(path)
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the file in it, one of {', '.join(READERS)}")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        near = nearest(suffix, READERS)
        hint = f"is it a {near}?" if near else "if it is one of these, name it so"
        raise UserError(f"{path}: cannot import '{suffix}'; what can be is {', '.join(READERS)}; {hint}")
    if not path.is_file():
        raise UserError(f"{path}: no such file")
    try:
        return importlib.import_module(f"rtctl.trace.imports.{READERS[suffix]}").read(path)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "mcap":
            raise
        raise UserError(f"{path} needs the package mcap: pip install mcap") from None
    except UnicodeDecodeError as error:
        raise UserError(f"{path} holds text that is not UTF-8: {error.object[:20]!r}") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from None
