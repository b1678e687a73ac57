"""The journal of what a run was told: one line for each order, so that a replay can give it again at the same tick.

Every row of a recording carries the number of the newest order that its tick had taken in (`order`), and this file,
`orders.jsonl` beside it, says what that order was: the command record as it then stood, and settings that changed.
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
    """Writes orders as they are given. `open` makes the file; orders from before are written into it then."""

    def __init__(self) -> None:
        self._early: list[str] = []
        self._file: Any = None

    def open(self, folder: Path) -> None:
        """Keep the journal in this folder from now on. Raises OSError."""
        self._file = os.fdopen(
            open_stream(folder / ORDERS, os.O_APPEND), "ab", buffering=0
        )  # no line waits in a buffer
        self._file.write("".join(self._early).encode())
        self._early = []

    def note(self, command: np.void, changed: dict[str, Any]) -> None:
        """Keep an order. A disk that is full costs the replay and nothing else."""
        line = json.dumps({"order": int(command["order"]), "command": plain(command), "changed": changed}) + "\n"
        if self._file is None:
            self._early.append(line)
            return
        try:
            self._file.write(line.encode())
        except OSError:
            self.close()

    def follow(self, folder: Path) -> None:
        """See that the journal lies in `folder`, where its recording is now. Raises OSError."""
        if self._file is None or moved.in_place(self._file.fileno(), folder / ORDERS):
            return
        old, self._file = self._file, os.fdopen(moved.copied(self._file.fileno(), folder / ORDERS), "ab", buffering=0)
        old.close()

    def close(self) -> None:
        """Nothing more will come."""
        if self._file is not None:
            self._file.close()
        self._file = None


def plain(record: np.void) -> dict[str, Any]:
    """A record's fields as JSON holds them; arrays of records as lists."""
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
    """Put the fields of an order back into a command record; what the record does not have is left out."""
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
    """Orders of a recording by their number; none where it has no journal. A torn last line is left out."""
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
