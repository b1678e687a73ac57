"""MATLAB file, version 5: a column vector for each signal, and the struct `units` with a field for each signal.

    s = load('trace.mat'); plot(s.t, s.ref), ylabel(s.units.ref)

Memory: two columns, 8 bytes a row each. A variable of this format holds up to 2 GiB.
"""

import re
from collections.abc import ItemsView, Iterator, Mapping
from pathlib import Path
from typing import Any

from scipy.io import savemat

from rtctl.config.errors import UserError
from rtctl.trace.bundle import as_json
from rtctl.trace.export.source import Source

LONGEST = 63  # characters of a name in MATLAB
MOST_ROWS = (2**31 - 1024) // 8
OURS = ("units", "help", "case_json", "columns")  # variables beside the signals


def names(source: Source) -> dict[str, str]:
    """Unique variable name for each column: a letter, then letters, digits and underscores."""
    given: dict[str, str] = {}
    for column in source.columns:
        name = re.sub(r"\W", "_", column.name, flags=re.ASCII)[:LONGEST]
        name = name if name[:1].isalpha() else f"x{name}"[:LONGEST]
        plain, number = name, 2
        while name in given.values() or name in OURS:
            name, number = f"{plain[: LONGEST - 4]}_{number}", number + 1
        given[column.name] = name
    return given


class Variables(Mapping[str, Any]):
    """Variables of the file. A signal is read on access: only one signal is in memory."""

    def __init__(self, source: Source):
        self._source, self._names = source, names(source)
        self._rest = {
            "units": {self._names[c.name]: c.unit for c in source.columns},
            "help": {self._names[c.name]: c.help for c in source.columns},
            "columns": {made: name for name, made in self._names.items()},
            "case_json": as_json(source.case),
        }

    def __iter__(self) -> Iterator[str]:
        return iter((*self._names.values(), *self._rest))

    def __len__(self) -> int:
        return len(self._names) + len(self._rest)

    def __getitem__(self, name: str) -> Any:
        if name in self._rest:
            return self._rest[name]
        return self._source.column(next(column for column, made in self._names.items() if made == name))

    def items(self) -> ItemsView[str, Any]:
        return ItemsView(self)


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError, UserError for more rows than the format holds."""
    if source.rows > MOST_ROWS:
        raise UserError(f"{source.rows} rows are more than the {MOST_ROWS} of a .mat file; take fewer with --every")
    with path.open("wb") as file:
        savemat(file, Variables(source), long_field_names=True, oned_as="column")
