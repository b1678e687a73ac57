"""Channels of a machine in Foxglove, as JSON: rows with their envelope, status, and events for the Log panel.

    /ldu         rows; topic and schema as in an exported MCAP file
    /ldu/min     lowest value of each signal since the row before, where rows are left out
    /ldu/max     highest value of each signal since the row before, where rows are left out
    /ldu/status  as `rtctl status --json`, without signals and late ticks
    /ldu/events  foxglove.Log

Rows and status are encoded only while their channel has a subscriber.
"""

import json
import math
from typing import Any

import foxglove
import numpy as np

from rtctl.foxglove.envelope import Thinned
from rtctl.machines.base import Column
from rtctl.trace import json_rows

INFO, WARNING, ERROR = 2, 3, 4  # levels of foxglove.Log
TIME = {"type": "object", "title": "time", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
LOG_SCHEMA = {
    "title": "foxglove.Log",
    "type": "object",
    "properties": {
        "timestamp": TIME,
        "level": {"type": "integer", "description": "1 debug, 2 info, 3 warning, 4 error"},
        "message": {"type": "string"},
        "name": {"type": "string"},
        "file": {"type": "string"},
        "line": {"type": "integer"},
    },
}
TYPES = {bool: "boolean", int: "number", float: "number", str: "string", list: "array", dict: "object"}


class Channels:
    """Channels of one machine in a Foxglove context. `zero` is the host's clock at t = 0, ns since 1970."""

    def __init__(
        self, context: Any, kind: str, columns: list[Column], status: dict[str, Any], thinned: bool, zero: int
    ):
        self.zero = zero
        self._names = [c.name for c in columns]
        topic = json_rows.topic(kind)

        def channel(suffix: str, name: str, schema: dict[str, Any]) -> Any:
            data = json.dumps(schema).encode()
            wrapped = foxglove.Schema(name=name, encoding="jsonschema", data=data)
            return foxglove.Channel(topic + suffix, schema=wrapped, message_encoding="json", context=context)

        name = json_rows.schema_name(kind)
        row = json_rows.schema(name, columns)
        self._rows = channel("", name, row)
        self._extremes = [channel(suffix, name, row) for suffix in ("/min", "/max")] if thinned else []
        self._status = channel("/status", f"{name}.status", _schema_of(f"{name}.status", _told(status)))
        self._events = channel("/events", "foxglove.Log", LOG_SCHEMA)

    def close(self) -> None:
        for channel in (self._rows, *self._extremes, self._status, self._events):
            channel.close()

    def at(self, t: float) -> int:
        """Log time of controller time `t`, ns since 1970."""
        return self.zero + round(t * 1e9)

    def rows(self, thinned: Thinned) -> None:
        """Send rows and, where rows were left out, their extremes."""
        for channel, rows in zip((self._rows, *self._extremes), thinned, strict=False):
            if len(rows) and channel.has_sinks():
                self._send(channel, rows)

    def status(self, status: dict[str, Any], t: float) -> None:
        if self._status.has_sinks():
            self._status.log(_finite(_told(status)), log_time=self.at(t))

    def event(self, text: str, t: float, name: str, level: int = INFO) -> None:
        """Send a line for the Log panel."""
        at = self.at(t)
        stamp = {"sec": at // 1_000_000_000, "nsec": at % 1_000_000_000}
        message = {"timestamp": stamp, "level": level, "message": text, "name": name, "file": "", "line": 0}
        self._events.log(message, log_time=at)

    def _send(self, channel: Any, rows: np.ndarray) -> None:
        columns = [rows[name].tolist() for name in self._names]
        for t, row in zip(rows["t"].tolist(), zip(*columns, strict=True), strict=True):
            channel.log(json_rows.message(self._names, row), log_time=self.at(t))


def _told(status: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in status.items() if key not in ("signals", "late_ticks")}


def _schema_of(title: str, value: Any) -> dict[str, Any]:
    """JSON Schema inferred from the status `value`; a key whose value is null has no type."""
    if isinstance(value, dict):
        parts = {key: _schema_of("", item) for key, item in value.items()}
        return {**({"title": title} if title else {}), "type": "object", "properties": parts}
    return {"type": TYPES[type(value)]} if type(value) in TYPES else {}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
