"""Settings that can change while a machine runs, each with its current value, unit and bounds."""

from typing import Any

from rtctl.config.fields import Shape, child, literals
from rtctl.config.schema import bounds

PARTS = ("law", "safety")  # parts of the config, in the order of the page
SIDES = ("gt", "ge", "lt", "le")


def tunable(machine: Any, values: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of settings for the page. `values` are parts of the config, as `get` returns them.

    `machine` is the machine of the config, a name or a description. Keys of a row: `path`, `value`, `type` (number,
    integer, boolean or choice), `unit`, `help`, `bounds` as text, and each bound by name (gt, ge, lt, le). Lists are
    left out: they are the structure of a law.
    """
    from rtctl import machines

    model = machines.class_of({"machine": machine, "law": values.get("law")})
    if model is None:
        return []
    whole = Shape(model, model=model)
    rows: list[dict[str, Any]] = []
    for part in PARTS:
        place = child(whole, part)
        if place is not None and part in values:
            rows += _below(place, part, values[part])
    return rows


def _below(place: Shape, path: str, value: Any) -> list[dict[str, Any]]:
    if isinstance(value, dict):
        model = place.model or (place.choices.get(str(value.get(place.tag))) if place.tag else None)
        if model is None:
            return []
        inner = Shape(model, model=model)
        rows = []
        for name, item in value.items():
            at = child(inner, name)
            if at is not None:
                rows += _below(at, f"{path}.{name}", item)
        return rows
    type_ = _type(place, value)
    if type_ is None or place.field is None:
        return []
    found = [(side, getattr(item, side, None)) for item in place.field.metadata for side in SIDES]
    return [
        {
            "path": path,
            "value": value,
            "type": type_,
            "unit": place.unit or "",
            "help": place.field.description or "",
            "bounds": bounds(place.field.metadata),
            "choices": [str(word) for word in literals(place.annotation)],
            **{side: bound for side, bound in found if bound is not None},
        }
    ]


def _type(place: Shape, value: Any) -> str | None:
    words = literals(place.annotation)
    if len(words) > 1:
        return "choice"
    if words or isinstance(value, (list, str)):
        return None
    if isinstance(value, bool) or place.annotation is bool:
        return "boolean"
    if place.annotation is int:
        return "integer"
    return "number" if place.unit is not None or isinstance(value, (int, float)) else None
