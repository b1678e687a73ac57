"""Import of recordings of other programs: one reader for each file format, and conversion to a bundle."""

import importlib
import zipfile
from pathlib import Path

from rtctl.config.errors import UserError, nearest
from rtctl.trace.imports.packed import packing, read_packed
from rtctl.trace.imports.table import Table
from rtctl.trace.imports.text_form import TextPlan

__all__ = ["READERS", "Table", "read"]

READERS = {  # file suffix -> module
    ".csv": "csv_file",
    ".tsv": "csv_file",
    ".txt": "csv_file",
    ".mat": "mat_file",
    ".npz": "npz_file",
    ".npy": "npz_file",
    ".parquet": "parquet_file",
    ".feather": "parquet_file",
    ".arrow": "parquet_file",
    ".mcap": "mcap_file",
    ".json": "json_file",
    ".jsonl": "json_file",
    ".ndjson": "json_file",
    ".mf4": "mf4_file",
    ".mdf": "mf4_file",
    ".tdms": "tdms_file",
    ".h5": "hdf5_file",
    ".hdf5": "hdf5_file",
}
PACKAGES = {  # package that a reader needs -> pip requirement
    "mcap": "mcap",
    "asammdf": "'rtctl[mf4]'",
    "nptdms": "'rtctl[tdms]'",
    "h5py": "'rtctl[hdf5]'",
    "zstandard": "zstandard",
    "lz4": "lz4",
}
MAGIC = {  # first bytes -> module
    b"PAR1": "parquet_file",
    b"ARROW1": "parquet_file",
    b"\x89MCAP0\r\n": "mcap_file",
    b"MDF     ": "mf4_file",
    b"UnFinMF ": "mf4_file",
    b"TDSm": "tdms_file",
    b"\x89HDF\r\n\x1a\n": "hdf5_file",
    b"MATLAB ": "mat_file",
    b"\x93NUMPY": "npz_file",
}
TEXT = ("csv_file", "json_file")
HEAD = 4096  # bytes read to detect the format


def read(path: Path | str, text: TextPlan | None = None) -> Table:
    """Table of all columns of a file, in memory; `text` is the user's description of a text file.

    Raises UserError for an unreadable file or an unknown format.
    """
    path = Path(path)
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the file in it, one of {', '.join(READERS)}")
    if not path.is_file():
        raise UserError(f"{path}: no such file" if not path.exists() else f"{path} is no regular file")
    try:
        return _read(path, text or TextPlan(), 0)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in PACKAGES:
            raise
        raise UserError(f"{path} needs the package {package}: pip install {PACKAGES[package]}") from None
    except UnicodeDecodeError as error:
        raise UserError(f"{path} holds text that is not UTF-8: {error.object[:20]!r}") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or 'damaged or of another kind'})") from None
    except MemoryError:
        raise UserError(f"{path}: there is not enough memory for it; write a shorter part or fewer columns") from None


def _read(path: Path, text: TextPlan, depth: int) -> Table:
    with path.open("rb") as file:
        head = file.read(HEAD)
    if packing(head):
        if depth:
            raise UserError(f"{path} is packed more than once; unpack it first")
        return read_packed(path, lambda inner: _read(inner, text, depth + 1))
    suffix = path.suffix.lower()
    by_name, by_content = READERS.get(suffix), _content(path, head)
    if by_content is None and by_name is None:
        near = nearest(suffix, READERS)
        hint = f"is it a {near}?" if near else "if it is one of these, name it so"
        raise UserError(f"{path}: cannot import '{suffix}'; importable are {', '.join(READERS)}; {hint}")
    kind = by_content or by_name
    if by_name == "mat_file" and kind == "hdf5_file":
        kind = by_name
    module = importlib.import_module(f"rtctl.trace.imports.{kind}")
    if kind == "csv_file":
        table = module.read(path, text)
    elif text.model_fields_set:
        option = sorted(text.model_fields_set)[0].replace("_", "-")
        raise UserError(
            f"{path} is read as {str(kind).removesuffix('_file')}, and --{option} applies only to text files"
        )
    else:
        table = module.read(path)
    if by_name is not None and kind != by_name and not (by_name in TEXT and kind in TEXT):
        name = str(kind).removesuffix("_file")
        table = table._replace(notes=(f"{path.name} is read as {name}, which it is by its content", *table.notes))
    return table


def _content(path: Path, head: bytes) -> str | None:
    """Module that reads a file with these first bytes; None where they identify no format."""
    for magic, module in MAGIC.items():
        if head.startswith(magic):
            return module
    if head[512:].startswith(b"\x89HDF\r\n\x1a\n"):
        return "hdf5_file"
    if head.startswith(b"PK\x03\x04"):
        return _zip(path)
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if text.startswith((b'{"', b"{\n", b"{\r", b'[{"', b"[[")) and path.suffix.lower() not in (".txt", ".tsv"):
        return "json_file"
    return None


def _zip(path: Path) -> str:
    """Module for a zip archive of arrays. Raises UserError for any other zip archive."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, ValueError, EOFError):
        return "npz_file"
    if path.suffix.lower() == ".npz" or any(name.endswith(".npy") for name in names):
        return "npz_file"
    if any(name.startswith("xl/") for name in names):
        raise UserError(f"{path} is a workbook of a spreadsheet; save the sheet as csv")
    raise UserError(f"{path} is a zip archive with {', '.join(names[:5])}; unpack it and give the file")
