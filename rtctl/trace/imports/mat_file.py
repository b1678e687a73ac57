"""Reader of MATLAB files: versions 4 and 5 with scipy, version 7.3 (HDF5) with h5py where it is installed.

A field of a struct is `s.x`, an element of a struct array or a cell `s.1`, a column of a matrix `y.1`. Units come from
a struct `units` beside the signals, as `rtctl trace export --to mat` writes it, or from a text `Unit` beside the data.
"""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatlabFunction, MatlabOpaque

from rtctl.config.errors import UserError
from rtctl.trace.imports.mat_size import check_size
from rtctl.trace.imports.nested import Refused, columns_of
from rtctl.trace.imports.table import Table

HDF5 = b"\x89HDF\r\n\x1a\n"
OBJECT = (
    "a MATLAB object of class {}, which only MATLAB reads; save numbers there: "
    "seconds(t - t(1)) of a datetime, timetable2table and table2struct(T, 'ToScalar', true) of a table"
)


def read(path: Path) -> Table:
    """The columns of a file. Raises UserError, OSError."""
    if _is_hdf5(path):
        from rtctl.trace.imports.hdf5_file import matlab_tree

        return table_of(path, matlab_tree(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about duplicate variable names
            check_size(path)
            found = loadmat(path, simplify_cells=True)
    except (OSError, UserError):
        raise
    except Exception:  # scipy raises any type for a damaged file
        raise UserError(
            f"{path} cannot be read as a MATLAB file: it is damaged, cut off or of another kind; save it again"
        ) from None
    return table_of(path, {k: v for k, v in _plain(found).items() if not k.startswith("__")})


def table_of(path: Path, found: Mapping[str, Any]) -> Table:
    """Table of the variables; `columns` and `case_json` of an rtctl export are no signals."""
    names = found.get("columns")
    own = {k: v for k, v in names.items() if isinstance(v, str)} if isinstance(names, Mapping) else {}
    rest = {key: value for key, value in found.items() if not (own and key in ("columns", "help", "case_json"))}
    tree = columns_of(rest)
    return Table(
        path,
        {own.get(name, name): values for name, values in tree.columns.items()},
        {own.get(name, name): unit for name, unit in tree.units.items()},
        notes=tree.notes(),
        left=tree.left,
    )


def object_of(kind: str) -> Refused:
    """Refusal of a variable of a MATLAB class."""
    return Refused(OBJECT.format(kind))


def _plain(value: Any) -> Any:
    """Refusals for MATLAB objects that scipy cannot read; other values unchanged."""
    if isinstance(value, MatlabOpaque):
        found = np.asarray(value).ravel()[0]
        return object_of(_text(found["s2"]))
    if isinstance(value, MatlabFunction):
        return Refused("a function")
    if isinstance(value, Mapping):
        out: dict[str, Any] = {}
        for key, item in value.items():
            if isinstance(item, MatlabOpaque):
                key = _text(np.asarray(item).ravel()[0]["s0"]) or key  # scipy names every MATLAB object None
            out[str(key)] = _plain(item)
        return out
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_plain(item) for item in value.ravel(order="F")]
    return value


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(520)
    return head.startswith(HDF5) or head[512:520] == HDF5  # MATLAB writes a text before the HDF5 signature
