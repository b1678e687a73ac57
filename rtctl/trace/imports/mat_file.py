"""MATLAB's files: version 5 by scipy, version 7.3, which is HDF5, by h5py where it is installed.

A field of a struct is `s.x`, a column of a matrix `y.1`. Units are those of a struct `units` beside the signals, as
`rtctl trace export --to mat` writes it.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from rtctl.config.errors import UserError
from rtctl.trace.imports.table import Table, flat

HDF5 = b"\x89HDF\r\n\x1a\n"


def read(path: Path) -> Table:
    """The columns of a file. Raises UserError, OSError."""
    if _is_hdf5(path):
        return Table(path, dict(flat(_hdf5(path))), {})
    try:
        found = loadmat(path, simplify_cells=True)
    except OSError:
        raise
    except Exception as error:  # whatever a damaged file makes of the reader
        raise UserError(f"{path} cannot be read as a MATLAB file: {error}") from None
    units = found.get("units")
    told = {k: v for k, v in units.items() if isinstance(v, str)} if isinstance(units, dict) else {}
    names = found.get("columns")
    own = {k: v for k, v in names.items() if isinstance(v, str)} if isinstance(names, dict) else {}
    columns = {own.get(name, name): values for name, values in flat(found)}
    return Table(path, columns, {own.get(name, name): unit for name, unit in told.items()})


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(520)
    return head.startswith(HDF5) or head[512:520] == HDF5  # MATLAB puts a text of its own in front


def _hdf5(path: Path) -> dict[str, Any]:
    try:
        import h5py
    except ModuleNotFoundError:
        raise UserError(
            f"{path} is of version 7.3 (HDF5), which needs the package h5py: pip install 'rtctl[hdf5]'; "
            "or save it with -v7 in MATLAB"
        ) from None
    try:
        with h5py.File(path) as file:
            return _group(h5py, file)
    except (OSError, RuntimeError, KeyError) as error:
        raise UserError(f"{path} cannot be read as HDF5: {error}") from None


def _group(h5py: Any, group: Any) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if isinstance(item, h5py.Group):
            out[name] = _group(h5py, item)
        elif item.attrs.get("MATLAB_class", b"") != b"char" and item.dtype.kind in "fiub":
            out[name] = np.asarray(item[()]).T  # MATLAB counts along columns
    return out
