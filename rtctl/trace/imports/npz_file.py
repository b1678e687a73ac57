"""Reader of numpy archives: an array a column, or a matrix with columns `name.1`, `name.2`; or one array, `.npy`."""

import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.nested import Refused, columns_of
from rtctl.trace.imports.table import Table

PICKLED = "pickled Python objects, which could run code and are never loaded; save plain arrays"


def read(path: Path) -> Table:
    """The columns of an archive. Nothing in it is ever run. Raises UserError, OSError."""
    with path.open("rb") as file:
        alone = file.read(len(npy.MAGIC_PREFIX)) == npy.MAGIC_PREFIX
    if not alone and not zipfile.is_zipfile(path):  # numpy's own message would be about pickles
        raise UserError(f"{path} cannot be read as npz: it is no archive of arrays; np.savez makes one")
    try:
        found = {"column": _alone(path)} if alone else _archive(path)
    except (OSError, UserError):
        raise
    except Exception:  # numpy raises any type for a damaged file
        raise UserError(f"{path} cannot be read as npz: it is damaged; write it again with np.savez") from None
    tree = columns_of(found)
    return Table(path, tree.columns, tree.units, notes=tree.notes(), left=tree.left)


def _alone(path: Path) -> Any:
    with path.open("rb") as file:
        return _array(path, file, path.stat().st_size, path.name)


def _archive(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = {}
    with zipfile.ZipFile(path) as archive:
        infos = archive.infolist()
        refuse_large(path, sum(info.file_size for info in infos), "its arrays")
        for info in infos:
            name = info.filename.removesuffix(".npy")
            if name == info.filename:
                found[name] = Refused("no array of numpy")
                continue
            if info.flag_bits & 1:
                raise UserError(f"{path}: {info.filename} in it is encrypted; save it without a password")
            with archive.open(info) as file:
                found[name] = _array(path, file, info.file_size, info.filename)
    return found


def _array(path: Path, file: IO[bytes], size: int, name: str) -> Any:
    """One array; its header is checked against the existing bytes before allocation."""
    version = npy.read_magic(file)
    shape, fortran, dtype = (npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0)(file)
    if dtype.hasobject:
        return Refused(PICKLED)
    count = 1
    for length in shape:
        count *= length
    if count * dtype.itemsize > size:
        raise UserError(f"{path}: the header of {name} speaks of {count} values of {dtype.itemsize} bytes and {size} "
                        "bytes are there; the file is damaged")  # fmt: skip
    refuse_large(path, count * dtype.itemsize, name)
    data = file.read(count * dtype.itemsize)
    if len(data) < count * dtype.itemsize:
        raise UserError(f"{path}: {name} ends after {len(data)} of {count * dtype.itemsize} bytes; the file is cut off")
    values = np.frombuffer(data, dtype)
    return values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
