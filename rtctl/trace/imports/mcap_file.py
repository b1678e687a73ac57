"""MCAP with JSON messages. With one topic a column is a field, `ref`, with several it is `/topic/ref`.

Where no field is the time, the log time is, in seconds from the first message on: the column `log_time`.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

from rtctl.config.errors import UserError
from rtctl.trace.imports.table import Table

TIME = "log_time"


def read(path: Path) -> Table:
    """The columns of all JSON topics. Raises UserError, OSError."""
    rows: dict[str, list[dict[str, float]]] = {}
    times: dict[str, list[int]] = {}
    units: dict[str, dict[str, str]] = {}
    others = set()
    try:
        with path.open("rb") as file:
            for schema, channel, message in make_reader(file).iter_messages():
                if channel.message_encoding != "json":
                    others.add(channel.message_encoding or "unknown")
                    continue
                if channel.topic not in rows:
                    rows[channel.topic], times[channel.topic] = [], []
                    units[channel.topic] = _units(schema.data if schema else b"{}")
                rows[channel.topic].append(dict(_numbers(json.loads(message.data))))
                times[channel.topic].append(message.log_time)
    except OSError:
        raise
    except Exception as error:  # whatever a damaged file makes of the reader
        raise UserError(f"{path} cannot be read as MCAP with JSON: {error}") from None
    if not rows:
        raise UserError(f"{path} has no JSON messages" + (f"; it has {', '.join(sorted(others))}" if others else ""))
    columns: dict[str, np.ndarray] = {}
    told: dict[str, str] = {}
    for topic, messages in rows.items():
        before = "" if len(rows) == 1 else f"{topic}/"
        for name in dict.fromkeys(name for message in messages for name in message):
            columns[before + name] = np.array([message.get(name, np.nan) for message in messages], np.float64)
            if name in units[topic]:
                told[before + name] = units[topic][name]
        columns[before + TIME] = (np.array(times[topic], np.int64) - times[topic][0]) / 1e9
        told[before + TIME] = "s"
    return Table(path, columns, told, clock=TIME if len(rows) == 1 else "")


def _numbers(message: Any, before: str = "") -> Iterator[tuple[str, float]]:
    for name, value in message.items() if isinstance(message, dict) else ():
        if isinstance(value, dict):
            yield from _numbers(value, f"{before}{name}.")
        elif isinstance(value, int | float):
            yield before + name, float(value)


def _units(schema: bytes) -> dict[str, str]:
    """Unit of each property, as `rtctl trace export --to mcap` writes them."""
    try:
        found = json.loads(schema)["properties"]
        return {name: p["unit"] for name, p in found.items() if p.get("unit") and isinstance(p["unit"], str)}
    except (ValueError, KeyError, TypeError, AttributeError):
        return {}
