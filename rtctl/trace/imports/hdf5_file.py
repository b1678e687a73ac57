"""Reader of HDF5, and of MATLAB 7.3 files, which are HDF5 with MATLAB's classes.

A group is read as a struct, a compound as a struct of its fields. Units are the attributes `unit` or `units` of a
dataset. In a MATLAB file, references lead to the elements of cells and struct arrays.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.nested import DEEPEST, Refused, Valued, columns_of
from rtctl.trace.imports.table import Table

ELSEWHERE = "its data are in another file, which is not read"
PLAIN = frozenset(  # classes of MATLAB that are numbers, text or made of them
    ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "logical", "char",
     "cell", "struct", "canonical empty")
)  # fmt: skip
DAMAGED = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError)  # raised by h5py for a damaged file


def read(path: Path) -> Table:
    """The columns of a file. Raises UserError, OSError."""
    tree = columns_of(_tree(path, matlab=False))
    return Table(path, tree.columns, tree.units, notes=tree.notes(), left=tree.left)


def matlab_tree(path: Path) -> dict[str, Any]:
    """Variables of a MATLAB file of version 7.3. Raises UserError."""
    return _tree(path, matlab=True)


def _tree(path: Path, matlab: bool) -> dict[str, Any]:
    try:
        import h5py
    except ModuleNotFoundError:
        what, way = ("of version 7.3 (HDF5)", "; or save it with -v7 in MATLAB") if matlab else ("HDF5", "")
        raise UserError(f"{path} is {what}, which needs the package h5py: pip install 'rtctl[hdf5]'{way}") from None
    try:
        with h5py.File(path, "r") as file:
            reader = _Reader(h5py, matlab)
            refuse_large(path, reader.size(file), "its data sets")
            return reader.group(file, 0)
    except DAMAGED:
        raise UserError(f"{path} cannot be read as HDF5: it is damaged or cut off; write it again") from None


class _Reader:
    def __init__(self, h5py: Any, matlab: bool) -> None:
        self.h5py, self.matlab = h5py, matlab

    def size(self, file: Any) -> int:
        """Bytes of all data sets."""
        sizes = []

        def add(_: str, item: Any) -> None:
            if isinstance(item, self.h5py.Dataset):
                sizes.append(int(item.size or 0) * max(item.dtype.itemsize, 8))

        file.visititems(add)  # visits each object once and skips soft and external links
        return sum(sizes)

    def group(self, group: Any, depth: int) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for name in group:
            if name.startswith("#") and self.matlab:
                continue
            link = group.get(name, getlink=True)
            if isinstance(link, self.h5py.ExternalLink):
                out[name] = Refused(ELSEWHERE)
            elif (item := group.get(name)) is None:
                out[name] = Refused("a link that leads nowhere")
            else:
                out[name] = self.item(item, depth)
        return out

    def item(self, item: Any, depth: int) -> Any:
        if depth > DEEPEST:
            return Refused(f"it is nested deeper than {DEEPEST} levels")
        kind = _text(item.attrs.get("MATLAB_class", b"")) if self.matlab else ""
        if kind and kind not in PLAIN:
            from rtctl.trace.imports.mat_file import object_of

            return Refused("a function") if kind == "function_handle" else object_of(kind)
        if isinstance(item, self.h5py.Group):
            return self.struct(item, depth)
        if not isinstance(item, self.h5py.Dataset):
            return Refused("a type and no data")
        if item.shape is None or "MATLAB_empty" in item.attrs:
            return "" if kind == "char" else np.empty(0)
        if item.is_virtual or item.external:
            return Refused(ELSEWHERE)
        if item.dtype == self.h5py.ref_dtype:
            return [self.item(item.file[ref], depth + 1) if ref else None for ref in np.ravel(item[()])]
        return self.values(item, kind)

    def struct(self, group: Any, depth: int) -> Any:
        """Struct as a mapping, struct array as its elements, or sparse matrix."""
        items = [group.get(name) for name in group]
        if self.matlab and "MATLAB_sparse" in group.attrs:
            rows = int(group.attrs["MATLAB_sparse"])
            parts = [group[name][()] if name in group else np.empty(0) for name in ("data", "ir", "jc")]
            return sparse.csc_matrix((parts[0], parts[1].astype(int), parts[2].astype(int)), (rows, len(parts[2]) - 1))
        if self.matlab and items and all(self._is_field(item) for item in items):
            fields = {name: self.item(group[name], depth + 1) for name in group}
            length = max(len(values) for values in fields.values())
            if all(len(values) == length for values in fields.values()):
                return [{name: values[k] for name, values in fields.items()} for k in range(length)]
        return self.group(group, depth + 1)

    def _is_field(self, item: Any) -> bool:
        """Whether a data set holds a field of each element of a struct array: references without a class."""
        plain = isinstance(item, self.h5py.Dataset) and item.shape is not None
        return plain and item.dtype == self.h5py.ref_dtype and "MATLAB_class" not in item.attrs

    def values(self, item: Any, kind: str) -> Any:
        if self.h5py.check_string_dtype(item.dtype) is not None:
            found = item.asstr(errors="replace")[()]
            return found if isinstance(found, str) else np.array(found, dtype=str)
        if item.dtype.kind == "O":
            return Refused("lists of differing length")
        values = np.asarray(item[()])
        if kind == "char":
            codes = values.T.reshape(-1) if values.ndim < 2 else values.T
            lines = ["".join(map(chr, line)).rstrip() for line in np.atleast_2d(codes)]
            return lines[0] if len(lines) == 1 else lines
        if self.matlab:
            values = values.T  # MATLAB stores column-major
            if values.dtype.names == ("real", "imag"):
                values = values["real"] + 1j * values["imag"]
        unit = next((_text(item.attrs[key]) for key in ("unit", "units", "Unit", "Units") if key in item.attrs), None)
        return values if unit is None else Valued(values, unit)


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size else ""
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
