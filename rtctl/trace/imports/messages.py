"""Columns of messages: one row for each message of nested names, lists, numbers, texts and time stamps.

`{"a": {"x": 1}, "p": [1, 2]}` is `a.x`, `p.1`, `p.2`. A stamp such as `{"sec": 5, "nanosec": 20}` is one column, a
duration since its epoch to the nanosecond.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.table import is_number

STAMPS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"), ("seconds", "nanos"))
CELL = 40  # bytes of a number in a list of Python
CHECKED = 4096  # messages between two checks of the memory size
TOLD = 5  # columns whose gaps are listed in notes


class Stamp(int):
    """Nanoseconds since an epoch."""


class Columns(NamedTuple):
    values: dict[str, np.ndarray]  # (n,) each
    gaps: tuple[str, ...]  # sentences on missing values
    left: dict[str, str]  # name that became no column -> reason


class Messages:
    """Rows that are added one by one. `what` names rows in messages to the user."""

    def __init__(self, path: Path, what: str = "messages") -> None:
        self.path, self.what, self.rows = path, what, 0
        self._lists: dict[str, list[Any]] = {}

    def add(self, message: Any) -> None:
        """Add a row. Raises UserError where the rows exceed the memory limit."""
        for name, value in _flat(message, ""):
            values = self._lists.setdefault(name, [])
            if len(values) > self.rows:  # the name is twice in the message
                values[self.rows] = value
                continue
            values.extend([None] * (self.rows - len(values)))
            values.append(value)
        self.rows += 1
        if self.rows % CHECKED == 0:
            refuse_large(self.path, CELL * self.rows * len(self._lists), f"its {self.what}")

    def columns(self) -> Columns:
        """Columns, nan or None where a row has no value."""
        columns, gaps, left = {}, [], {}
        for name, values in self._lists.items():
            values.extend([None] * (self.rows - len(values)))
            missing = sum(value is None for value in values)
            text = next((value for value in values if isinstance(value, str)), None)
            if text is not None and not any(is_number(value) for value in values):
                left[name] = f"text ({text[:30]!r})"
                continue
            if missing:
                gaps.append(f"{name} is missing in {missing} of {self.rows} {self.what}")
            columns[name] = _column(values, missing)
        more = [f"{len(gaps) - TOLD} more columns have gaps"] if len(gaps) > TOLD else []
        return Columns(columns, tuple(gaps[:TOLD] + more), left)


def _flat(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        stamp = _stamp(value)
        if stamp is not None and len(value) == 2 and name:
            yield name, stamp
            return
        before = f"{name}." if name else ""
        if stamp is not None:
            yield f"{before}stamp", stamp
        for key, item in value.items():
            yield from _flat(item, f"{before}{key}")
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from _flat(item, f"{name}.{k + 1}" if name else str(k + 1))
    else:
        yield name or "value", value


def _stamp(value: Mapping[str, Any]) -> Stamp | None:
    for whole, rest in STAMPS:
        if _is_int(value.get(whole)) and _is_int(value.get(rest)):
            return Stamp(value[whole] * 1_000_000_000 + value[rest])
    return None


def _is_int(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _column(values: list[Any], missing: int) -> np.ndarray:
    there = [value for value in values if value is not None] if missing else values
    kinds = {type(value) for value in there}
    if kinds == {Stamp} and _fits(there):
        found = np.full(len(values), np.timedelta64("NaT", "ns"))
        found[[value is not None for value in values]] = np.array(there, np.int64).astype("timedelta64[ns]")
        return found
    if kinds == {bool} and not missing:
        return np.array(values, bool)
    if kinds == {int} and not missing and _fits(there):
        return np.array(values, np.int64)
    if kinds <= {bool, int, float, Stamp}:
        return np.array([np.nan if value is None else _double(value) for value in values], float)
    found = np.empty(len(values), object)
    found[:] = values
    return found


def _fits(values: list[int]) -> bool:
    return -(2**63) <= min(values) and max(values) < 2**63


def _double(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return float("inf")
