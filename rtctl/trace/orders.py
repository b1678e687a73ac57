"""Journal of the orders of a run, `orders.jsonl`: one line for each order, for a replay at the same tick.

Column `order` of a recording is the number of the newest order that the tick had read. The journal holds for each
number the command record and the changed settings.
"""

import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.config.files import inside, open_stream
from rtctl.trace import moved

ORDERS = "orders.jsonl"


class Order(NamedTuple):
    number: int
    command: dict[str, Any]  # fields of the command record
    changed: dict[str, Any]  # dotted path of a setting -> its new value


class Journal:
    """Writer of the journal. `open` creates the file and writes the earlier orders."""

    def __init__(self) -> None:
        self._early: list[str] = []
        self._file: Any = None

    def open(self, folder: Path) -> None:
        """Write the journal into `folder` from now on. Raises OSError."""
        self._file = os.fdopen(open_stream(folder / ORDERS, os.O_APPEND), "ab", buffering=0)  # unbuffered
        self._file.write("".join(self._early).encode())
        self._early = []

    def note(self, command: np.void, changed: dict[str, Any]) -> None:
        """Write an order. A full disk ends the journal, and with it the replay, but not the run."""
        line = json.dumps({"order": int(command["order"]), "command": plain(command), "changed": changed}) + "\n"
        if self._file is None:
            self._early.append(line)
            return
        try:
            self._file.write(line.encode())
        except OSError:
            self.close()

    def follow(self, folder: Path) -> None:
        """Move the journal to `folder`, the present folder of its recording. Raises OSError."""
        if self._file is None or moved.in_place(self._file.fileno(), folder / ORDERS):
            return
        old, self._file = self._file, os.fdopen(moved.copied(self._file.fileno(), folder / ORDERS), "ab", buffering=0)
        old.close()

    def close(self) -> None:
        """Close the journal."""
        if self._file is not None:
            self._file.close()
        self._file = None


def plain(record: np.void) -> dict[str, Any]:
    """Fields of a record as JSON values; arrays of records as lists."""
    out: dict[str, Any] = {}
    for name in record.dtype.names or ():
        value = record[name]
        if value.dtype.names and value.shape:
            out[name] = [plain(item) for item in value]
        elif value.dtype.names:
            out[name] = plain(value)
        else:
            out[name] = value.tolist()
    return out


def restore(record: Any, fields: dict[str, Any]) -> None:
    """Write the fields of an order into a command record. Fields that the record lacks are skipped."""
    for name, value in fields.items():
        if name not in (record.dtype.names or ()):
            continue
        if isinstance(value, dict):
            restore(record[name], value)
        elif isinstance(value, list) and record[name].shape and all(isinstance(item, dict) for item in value):
            for item, fields_ in zip(record[name], value, strict=False):
                restore(item, fields_)
        else:
            try:
                record[name] = value
            except (TypeError, ValueError, OverflowError) as error:
                raise UserError(f"'{name}' of an order is {value!r:.60}: {error}") from None


def orders(folder: Path) -> dict[int, Order]:
    """Orders of a recording by number; empty without a journal. An incomplete last line is skipped."""
    path = inside(folder / ORDERS, folder)
    if not path.exists():
        return {}
    out = {}
    lines = path.read_bytes().splitlines()
    for at, line in enumerate(lines, 1):
        try:
            found = json.loads(line)
            order = Order(int(found["order"]), dict(found["command"]), dict(found["changed"]))
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            if at == len(lines):
                break
            raise UserError(f"{path}, line {at}: not an order ({error})") from error
        out[order.number] = order
    return out
