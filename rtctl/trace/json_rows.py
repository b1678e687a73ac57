"""Rows as JSON messages with a schema, for MCAP files and for a live connection to Foxglove.

nan (not measured) and infinite values are left out of a message: JSON has neither. The schema holds the units.
"""

import json
import math
from collections.abc import Sequence
from typing import Any

from rtctl.machines.base import Column

PACKAGE = "rtctl"
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def topic(kind: str) -> str:
    """Topic name `/ivu` of kind `ivu`: a curve is /ivu/ref in PlotJuggler and /ivu.ref in Foxglove."""
    return f"/{kind}"


def schema_name(kind: str) -> str:
    return f"{PACKAGE}.{kind}"


def schema(name: str, columns: Sequence[Column]) -> dict[str, Any]:
    """JSON Schema of a message, with the extra key `unit` beside each type."""
    return {
        "$schema": DIALECT,
        "title": name,
        "type": "object",
        "properties": {c.name: {"type": "number", "description": _words(c), "unit": c.unit} for c in columns},
    }


def message(names: Sequence[str], row: Sequence[Any]) -> str:
    """JSON text of one row, with all digits of every number."""
    try:
        return json.dumps(dict(zip(names, row, strict=True)), allow_nan=False)
    except ValueError:
        return json.dumps({name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)})


def _words(column: Column) -> str:
    unit = f"[{column.unit}]" if column.unit else ""
    return f"{column.help} {unit}".strip()
