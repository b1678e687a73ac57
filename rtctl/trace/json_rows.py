"""Rows as JSON messages with a schema, the same in an MCAP file and on a live connection to Foxglove.

What was not measured (nan) or is infinite is left out of a message, since JSON does not know it. Units stand in the
schema.
"""

import json
import math
from collections.abc import Sequence
from typing import Any

from rtctl.machines.base import Column

PACKAGE = "rtctl"
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def topic(kind: str) -> str:
    """/ivu, so that a curve is /ivu/ref in PlotJuggler and /ivu.ref in Foxglove."""
    return f"/{kind}"


def schema_name(kind: str) -> str:
    return f"{PACKAGE}.{kind}"


def schema(name: str, columns: Sequence[Column]) -> dict[str, Any]:
    """JSON Schema of a message; `unit` beside the type is for people and for programs that want it."""
    return {
        "$schema": DIALECT,
        "title": name,
        "type": "object",
        "properties": {c.name: {"type": "number", "description": _words(c), "unit": c.unit} for c in columns},
    }


def message(names: Sequence[str], row: Sequence[Any]) -> str:
    """One row, every number with all its digits."""
    try:
        return json.dumps(dict(zip(names, row, strict=True)), allow_nan=False)
    except ValueError:
        return json.dumps({name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)})


def _words(column: Column) -> str:
    unit = f"[{column.unit}]" if column.unit else ""
    return f"{column.help} {unit}".strip()
