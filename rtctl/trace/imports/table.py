"""Table that a reader returns: columns by their names in the file, and names of rows for messages."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError, nearest
from rtctl.trace.imports.times import is_date, seconds


def row_number(row: int) -> str:
    """Name of a row (0 is the first) in messages, for a file without lines."""
    return f"row {row}"


class Table(NamedTuple):
    path: Path
    columns: dict[str, np.ndarray]  # (n,) each, of any type; n may differ
    units: dict[str, str]  # column -> unit, where the file has one
    clock: str = ""  # column that is the time in s where no other is mapped
    where: Callable[[int], str] = row_number
    notes: tuple[str, ...] = ()  # sentences for the user: assumptions and skipped items
    left: Mapping[str, str] = MappingProxyType({})  # name in the file that became no column -> reason

    def has(self, name: str, use: str) -> np.ndarray:
        """Column (n,); `use` is its purpose in messages. Raises UserError with the nearest name."""
        if name in self.columns:
            return self.columns[name]
        if name in self.left:
            raise UserError(f"{self.path}: '{name}' (wanted as {use}) is no column: {self.left[name]}")
        near = nearest(name, self.columns)
        there = list(self.columns)[:20]
        hint = f"is it '{near}'?" if near else f"it has {', '.join(there) or 'none'}"
        if "," in name:
            hint += "; several are given as ours=theirs,ours=theirs"
        raise UserError(f"{self.path} has no column '{name}' (wanted as {use}); {hint}")

    def times(self, name: str, factor: float) -> np.ndarray:
        """Times (n,) in s of a column; `factor` is the unit of its numbers in s.

        Columns keep the type of the file: time stamps (datetime64), durations (timedelta64), integers, doubles.
        Raises UserError that names the first row without a time.
        """
        values = self.has(name, "t")
        if is_date(values):
            gone = np.flatnonzero(np.isnat(values))
            if len(gone):
                raise UserError(
                    f"{self.path}: column '{name}', {self.where(int(gone[0]))}: empty; every row needs a time"
                )
        elif values.dtype.kind not in "iu":
            values = self.numbers(name, "t")
        return seconds(values, factor)

    def empty(self, name: str) -> bool:
        """Whether all rows of a column of numbers are nan."""
        values = self.columns[name]
        return values.dtype.kind == "f" and bool(np.isnan(values).all())

    def numbers(self, name: str, use: str) -> np.ndarray:
        """Finite doubles (n,) of a column. Raises UserError with the first row that is not finite."""
        values = self.has(name, use)
        if is_date(values):
            raise UserError(
                f"{self.path}: column '{name}' (wanted as {use}) holds dates or durations; only t can be one: "
                f"--map t={name}"
            )
        if values.dtype.kind not in "fiub":
            row = next((k for k, cell in enumerate(values) if not is_number(cell)), None)
            if row is not None:
                what = "empty" if values[row] is None else f"{values[row]!r:.40} is not a number"
                raise UserError(f"{self.path}: column '{name}', {self.where(row)}: {what}")
        found = values.astype(np.float64)
        bad = np.flatnonzero(~np.isfinite(found))
        if len(bad):
            more = f", and {len(bad) - 1} more" if len(bad) > 1 else ""
            what = "empty or nan" if np.isnan(found[bad[0]]) else f"{found[bad[0]]:g}"
            raise UserError(
                f"{self.path}: column '{name}', {self.where(int(bad[0]))}{more}: {what}; every row needs a finite "
                "number: leave such rows out at the ends, fill them in between"
            )
        return found


def is_number(value: Any) -> bool:
    """Whether a cell is a number or the text of a number."""
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True
