"""JSON: one object a row (JSON lines), a list of objects or of rows, or an object of lists.

A nested name is `a.x`, an element of a list in a row `p.1`. A mapping `units` beside the columns gives their units.
"""

import json
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.messages import Messages
from rtctl.trace.imports.nested import columns_of
from rtctl.trace.imports.table import Table, row_number

LONGEST = 1 << 20  # characters of a row; a longer first line means one JSON document
GROWTH = 10  # bytes of memory for each byte of text of a document, estimated


def read(path: Path) -> Table:
    """The columns of a file. Raises UserError, OSError, UnicodeDecodeError."""
    with path.open(encoding="utf-8-sig") as file:
        first, second = _line(file), _line(file)
    if not first:
        raise UserError(f"{path} is empty")
    if _parsed(first) is not None and (second or _is_row(first)):
        return _lines(path)
    return _document(path)


def _line(file: IO[str]) -> str:
    """Next non-blank line, up to LONGEST characters."""
    while line := file.readline(LONGEST):
        if line.strip():
            return line
    return ""


def _parsed(text: str) -> Any:
    """Object or list in a line; None where the line is neither."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, Mapping | list) else None


def _is_row(text: str) -> bool:
    """Whether the only line of a file is a row of single values."""
    found = _parsed(text)
    return isinstance(found, Mapping) and not any(isinstance(item, list | Mapping) for item in found.values())


def _lines(path: Path) -> Table:
    refuse_large(path, path.stat().st_size, "its lines")
    rows, at, notes = Messages(path, "lines"), array("Q"), []
    with path.open(encoding="utf-8-sig") as file:
        for number, line in enumerate(file, 1):
            if not line.strip():
                continue
            found = _parsed(line)
            if found is None and not line.endswith("\n"):
                notes.append(f"the last line, {number}, is cut off: {rows.rows} lines are whole and taken")
                break
            if found is None:
                raise UserError(f"{path}: line {number} is no JSON object: {line.strip()[:30]!r}")
            rows.add(found)
            at.append(number)
    columns, gaps, left = rows.columns()

    def where(row: int) -> str:
        return f"line {at[row]}" if 0 <= row < len(at) else row_number(row)

    return Table(path, columns, {}, where=where, notes=(*notes, *gaps), left=left)


def _document(path: Path) -> Table:
    refuse_large(path, path.stat().st_size * GROWTH, "its values")
    text = path.read_text(encoding="utf-8-sig")
    try:
        found = json.loads(text)
    except json.JSONDecodeError as error:
        what = "it is cut off there" if error.pos >= len(text.rstrip()) - 1 else "it is no JSON there"
        raise UserError(f"{path}: line {error.lineno}, character {error.colno}: {what}") from None
    except (ValueError, RecursionError):
        raise UserError(f"{path} cannot be read as JSON: it is nested too deeply, or a number is too long") from None
    notes: list[str] = []
    if isinstance(found, Mapping) and isinstance(found.get("columns"), list) and isinstance(found.get("data"), list):
        names = [str(name) for name in found["columns"]]  # pandas, orient="split"
        found = [names, *found["data"]]
    tree = _tree(path, found, notes)
    if not isinstance(tree, Mapping):
        tree = {"value": tree}
    made = columns_of(tree)
    return Table(path, made.columns, made.units, notes=(*notes, *made.notes()), left=made.left)


def _tree(path: Path, value: Any, notes: list[str]) -> Any:
    """Lists of rows as columns, lists of values as arrays."""
    if isinstance(value, Mapping):
        if len(value) > 1 and all(str(key).isdigit() for key in value):
            return _tree(path, list(value.values()), notes)  # pandas, orient="columns" and "index"
        return {str(key): _tree(path, item, notes) for key, item in value.items()}
    if not isinstance(value, list) or len(value) < 2:
        return value
    if all(isinstance(item, Mapping) for item in value) and not _are_series(value):
        return _rows(path, value, notes)
    if all(isinstance(item, list) for item in value):
        head = value[0]
        if head and all(isinstance(name, str) for name in head) and not all(isinstance(v, str) for v in value[1]):
            for k, row in enumerate(value[1:], 1):
                if len(row) != len(head):
                    raise UserError(f"{path}: row {k} has {len(row)} values where there are {len(head)} names")
            return _rows(path, [dict(zip(head, row, strict=True)) for row in value[1:]], notes)
        if len({len(item) for item in value}) == 1 and len(value[0]) < len(value):
            return _rows(path, value, notes)
    if any(isinstance(item, Mapping | list) for item in value):
        return [_tree(path, item, notes) for item in value]
    rows = Messages(path, "values")
    for item in value:
        rows.add(item)
    made = rows.columns()
    notes += [gap.removeprefix("value is ") + " of a list" for gap in made.gaps]
    return made.values.get("value", [])


def _are_series(items: list[Mapping[str, Any]]) -> bool:
    """Whether the elements are signals: each has a list of values longer than the list of elements."""
    return all(any(isinstance(value, list) and len(value) > len(items) for value in item.values()) for item in items)


def _rows(path: Path, rows: list[Any], notes: list[str]) -> dict[str, np.ndarray]:
    made = Messages(path, "rows")
    for row in rows:
        made.add(row)
    found = made.columns()
    notes += found.gaps
    return found.values
