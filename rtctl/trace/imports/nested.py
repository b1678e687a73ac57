"""Columns of nested data: structs, struct arrays, cells, matrices, records.

A field is `s.x`, an element of a struct array or a cell `s.1`, a column of a matrix `y.1`, of an array with three
indices `y.1.2`. An element with a text `Name` or `label` beside its one array is also reachable by that text. `left`
holds every other name with the reason.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from rtctl.trace.imports.limits import limit

NAMES = ("name", "label", "title")  # fields of an element that name it, in any case
UNITS = ("unit", "units")
NO_UNIT = ("-", "1", "none", "")
DEEPEST = 32  # levels; bounds files that refer to themselves
TOLD = 5  # names listed with their reason
NUMBERS = "fiubMm"
ONE_VALUE = "one value and no column"


class Valued(NamedTuple):
    """Value with its unit as written in the file."""

    values: Any
    unit: str


class Refused(NamedTuple):
    """Reason why the reader did not convert an item to numbers."""

    why: str


class Tree(NamedTuple):
    columns: dict[str, np.ndarray]  # (n,) each, in the file's own type
    units: dict[str, str]
    left: dict[str, str]  # name that became no column -> reason
    lost: list[str]  # names in `left` that hold data

    def notes(self) -> tuple[str, ...]:
        """Sentences on names in `lost`."""
        return notes_of({name: self.left[name] for name in self.lost})


def notes_of(left: Mapping[str, str]) -> tuple[str, ...]:
    """Sentences on names that became no column, {name: reason}; the first TOLD with reason, the others by name."""
    told = [f"{name} is no column: {why}" for name, why in list(left.items())[:TOLD]]
    others = list(left)[TOLD:]
    if others:
        told.append(f"{len(others)} more are no columns: {', '.join(others[: 4 * TOLD])}")
    return tuple(told)


def columns_of(found: Mapping[str, Any]) -> Tree:
    """Columns of a tree of mappings, sequences, arrays, Valued and Refused."""
    tree = Tree({}, {}, {}, [])
    _mapping(tree, found, "", 0)
    return tree


def unit_text(text: str) -> str:
    """Unit as written in a file; "" for `-` and `1`, numbers without unit."""
    text = text.strip()
    return "" if text.lower() in NO_UNIT else text


def _walk(tree: Tree, value: Any, name: str, depth: int) -> None:
    if depth > DEEPEST:
        _leave(tree, name, f"it is nested deeper than {DEEPEST} levels")
    elif isinstance(value, Refused):
        _leave(tree, name, value.why)
    elif isinstance(value, Valued):
        before = set(tree.columns)
        _walk(tree, value.values, name, depth)
        if value.unit.strip():
            tree.units.update(dict.fromkeys((c for c in tree.columns if c not in before), unit_text(value.unit)))
    elif isinstance(value, Mapping):
        _mapping(tree, value, f"{name}.", depth + 1)
    elif isinstance(value, str | bytes):
        tree.left[name] = f"text ({str(value)[:30]!r})"
    elif sparse.issparse(value):
        if value.shape[0] * value.shape[1] * 8 > limit():
            _leave(tree, name, f"a sparse matrix of {value.shape[0]} x {value.shape[1]}")
        else:
            _array(tree, value.toarray(), name, depth)
    elif isinstance(value, np.ndarray):
        _array(tree, value, name, depth)
    elif isinstance(value, Sequence):
        _elements(tree, list(value), name, depth)
    elif isinstance(value, complex):
        tree.left[name] = "one complex number"
    elif isinstance(value, int | float | np.generic) or value is None:
        tree.left[name] = ONE_VALUE
    else:
        _leave(tree, name, f"an object of type {type(value).__name__}")


def _leave(tree: Tree, name: str, why: str) -> None:
    tree.left[name] = why
    tree.lost.append(name)


def _mapping(tree: Tree, value: Mapping[str, Any], before: str, depth: int) -> None:
    start = len(tree.columns)
    texts = {str(key).casefold(): text for key, text in value.items() if isinstance(text, str)}
    tables = [item for key, item in value.items() if str(key).casefold() in UNITS and _is_texts(item)]
    for key, item in value.items():
        if str(key).casefold() in UNITS and (isinstance(item, str) or _is_texts(item)):
            continue
        _walk(tree, item, f"{before}{key}", depth)
    made = list(tree.columns)[start:]
    for table in tables:
        for key, text in table.items():
            name = f"{before}{key}"
            mine = (column for column in made if column == name or column.startswith(f"{name}."))
            if isinstance(text, str) and text.strip():  # an empty text is no unit
                tree.units.update(dict.fromkeys(mine, unit_text(text)))
    if len(made) == 1 or (made and all(name.rpartition(".")[0] == made[0].rpartition(".")[0] for name in made)):
        for key in UNITS:
            if texts.get(key, "").strip():
                tree.units.update({name: unit_text(texts[key]) for name in made if name not in tree.units})
    if len(made) == 1 and before:
        for key in NAMES:
            alias = texts.get(key, "").strip()
            if alias and alias not in tree.columns:
                tree.columns[alias] = tree.columns[made[0]]
                if made[0] in tree.units:
                    tree.units[alias] = tree.units[made[0]]
                break


def _is_texts(item: Any) -> bool:
    """Whether all fields are texts; an empty text of MATLAB is an empty array."""
    return isinstance(item, Mapping) and bool(item) and all(
        isinstance(text, str) or (isinstance(text, np.ndarray) and text.size == 0) for text in item.values()
    )  # fmt: skip


def _elements(tree: Tree, items: list[Any], name: str, depth: int) -> None:
    """Elements of a cell or a struct array; a sequence of numbers or texts is one column."""
    if not items:
        tree.left[name] = "empty"
    elif all(_is_number(item) for item in items):
        _array(tree, np.array([np.asarray(item).item() for item in items]), name, depth)
    elif all(isinstance(item, str) for item in items):
        _array(tree, np.array(items), name, depth)
    else:
        for k, item in enumerate(items):
            _walk(tree, item, f"{name}.{k + 1}", depth + 1)


def _is_number(item: Any) -> bool:
    if isinstance(item, np.ndarray):
        return bool(item.size == 1 and item.dtype.kind in "fiub")
    return isinstance(item, int | float | np.floating | np.integer | np.bool_)


def _array(tree: Tree, value: np.ndarray, name: str, depth: int) -> None:
    kind = value.dtype.kind
    if value.dtype.names:
        _mapping(tree, {field: value[field] for field in value.dtype.names}, f"{name}.", depth + 1)
    elif kind == "O":
        _elements(tree, list(value.ravel(order="F")), name, depth)
    elif kind == "c":
        _leave(tree, name, "complex numbers; write real and imaginary part as two columns")
    elif kind in "US":
        if value.size > 1:
            _columns(tree, value.astype(object), name)
        else:
            tree.left[name] = "text"
    elif kind not in NUMBERS:
        _leave(tree, name, f"values of type {value.dtype}")
    elif value.size < 2:
        tree.left[name] = ONE_VALUE if value.size else "empty"
    else:
        _columns(tree, value, name)


def _columns(tree: Tree, value: np.ndarray, name: str) -> None:
    """Columns of an array; rows run along the longest index, the first one of equal lengths."""
    value = np.squeeze(value)
    if value.ndim <= 1:
        tree.columns[name] = value.reshape(-1)
        return
    tall = np.moveaxis(value, int(np.argmax(value.shape)), 0)
    for index in np.ndindex(*tall.shape[1:]):
        tree.columns[f"{name}.{'.'.join(str(k + 1) for k in index)}"] = tall[(slice(None), *index)]
