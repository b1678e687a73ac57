"""Resolved axes of a campaign: values as plain data in SI, files read, paths checked."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydantic import ValidationError

from rtctl.campaign.settings import MOST_VALUES, AxisSettings
from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError
from rtctl.config.fields import Shape, child, unknown, written
from rtctl.config.load import load_settings
from rtctl.config.units import to_si

CONFIG, REFERENCE = "config", "reference"
LONGEST = 60  # characters, longest label

Axis = list[dict[str, Any]]  # columns that step together; each has name, paths, values, labels, unit
Where = Callable[[tuple], str]  # keys of the campaign file -> file and line
Find = Callable[[str], Any]  # name of a file -> path


def resolve(name: str, given: Any, base: Any, where: Where, find: Find) -> Axis:
    """Axis of the key `name` of a matrix, for machines like `base`. Raises UserError with file and line."""
    key: tuple = ("matrix", name)
    settings = _checked(given, where, key)
    if settings.together is None:
        return [_column(name, settings, base, where, find, key)]
    columns = []
    for inner, data in settings.together.items():
        at = (*key, "together", inner)
        one = _checked(data, where, at)
        if one.together is not None:
            raise UserError(f"{where(at)}: {'.'.join(at)}: `together` cannot hold another `together`")
        columns.append(_column(inner, one, base, where, find, at))
    lengths = {c["name"]: len(c["values"]) for c in columns}
    if len(set(lengths.values())) != 1:
        told = ", ".join(f"{n} has {count}" for n, count in lengths.items()) or "it is empty"
        raise UserError(f"{where(key)}: {'.'.join(key)}: axes that step together are equally long; {told}")
    return columns


def _checked(given: Any, where: Where, key: tuple) -> AxisSettings:
    """Axis settings as written; a list stands for `values`."""
    data = {"values": given} if isinstance(given, list) else given
    try:
        return AxisSettings.model_validate(data)
    except ValidationError as error:
        said = sentences(error, AxisSettings, data).split("\n")
        raise UserError("\n".join(f"{where(key)}: {'.'.join(key)}: {line}" for line in said)) from error


def _column(name: str, axis: AxisSettings, base: Any, where: Where, find: Find, key: tuple) -> dict[str, Any]:
    paths = axis.paths or [name]
    try:
        units = [place_of(base, path).unit for path in paths if path != CONFIG]
        values = [_plain(value, units[0] if units else None) for value in _values(axis, units[0] if units else None)]
        labels: list[Any] = [_label(value) for value in values]
        if isinstance(axis.values, dict):
            labels = list(axis.values)
        if paths == [REFERENCE]:
            values = [reference_of(base, value, find) if isinstance(value, str) else value for value in values]
    except (UserError, ValueError) as error:
        raise UserError(f"{where(key)}: {'.'.join(key)}: {error}") from None
    if not values:
        raise UserError(f"{where(key)}: {'.'.join(key)}: has no values; an axis needs one at least")
    numbers = all(isinstance(x, (int, float)) for x in labels)
    unit = units[0] if units and units[0] and numbers else ""
    return {"name": name, "paths": paths, "values": values, "labels": labels, "unit": unit}


def _values(axis: AxisSettings, unit: str | None) -> list[Any]:
    """Values as written or as drawn. Raises ValueError."""
    if axis.values is not None:
        return list(axis.values.values() if isinstance(axis.values, dict) else axis.values)
    if axis.range is not None:
        first, last, step = (_number(x, unit) for x in (*axis.range, 1)[:3])
        if not step or (last - first) / step < 0:
            raise ValueError(f"range: from {first:g} to {last:g} in steps of {step:g} leads nowhere")
        return [first + i * step for i in range(_few(int((last - first) / step + 1e-9) + 1))]
    if axis.linspace is not None:
        first, last = (_number(x, unit) for x in axis.linspace[:2])
        count = axis.linspace[2]
        if not isinstance(count, int) or count < 1:
            raise ValueError(f"linspace: how many is {count!r}; it should be a whole number, at least 1")
        return np.linspace(first, last, _few(count)).tolist()
    assert axis.random is not None and axis.count is not None
    low, high = (_number(x, unit) for x in axis.random)
    if not low <= high:
        raise ValueError(f"random: {low:g} is above {high:g}; write the lowest first")
    return np.random.default_rng(axis.seed).uniform(low, high, axis.count).tolist()


def _few(count: int) -> int:
    if count > MOST_VALUES:
        raise ValueError(f"has {count} values; {MOST_VALUES} are the most")
    return count


def _number(value: Any, unit: str | None) -> Any:
    value = to_si(value, unit or "")
    if not isinstance(value, (int, float)):
        raise ValueError(f"expected a number, not {value!r:.40}")
    return value


def _plain(value: Any, unit: str | None) -> Any:
    """Number in the unit of the setting for a text such as "22 mm". The run reports a value that does not fit."""
    if unit is None or not isinstance(value, str):
        return value
    try:
        return to_si(value, unit)
    except ValueError:
        return value


def _label(value: Any) -> Any:
    """Label of a value in the table: the value, or a text where it is no scalar."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    text = ", ".join(_words(item) for item in value) if isinstance(value, list) else _words(value)
    text = text or "none"
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def _words(value: Any) -> str:
    if isinstance(value, dict):
        named = value.get("fault") or value.get("term")
        return str(named) if named else " ".join(f"{k}={_words(v)}" for k, v in value.items())
    return f"({', '.join(map(_words, value))})" if isinstance(value, list) else str(value)


def reference_of(base: Any, name: str, find: Find) -> Any:
    """Reference file as plain data in the units of the machine. Raises UserError."""
    model = type(base).model_fields[REFERENCE].annotation
    return written(load_settings(find(name), model, []))


def place_of(settings: Any, path: str) -> Shape:
    """Shape of a config at a dotted path. Raises UserError for an unknown key."""
    place, node = Shape(type(settings), model=type(settings)), settings
    parts = path.split(".")
    for i, part in enumerate(parts):
        here = ".".join(parts[:i])
        if hasattr(type(node), "model_fields"):
            place = Shape(type(node), model=type(node))
        index = place.item is not None
        if index and not (part.isascii() and part.isdigit() and len(part) < 7):
            raise UserError(f"'{part[:40]}' is not an index of {here}; write e.g. {here}.0")
        found = child(place, int(part) if index else part)
        if found is None and place.choices:
            return Shape(None)  # a union; another key selects its member
        if found is None:
            known = place.model.model_fields if place.model else ()
            raise UserError(f"{path}: unknown key '{part[:40]}'; {unknown(part, known)}")
        place = found
        node = _inner(node, int(part) if index else part)
    return place


def _inner(node: Any, part: Any) -> Any:
    if isinstance(part, int):
        return node[part] if isinstance(node, (list, tuple)) and part < len(node) else None
    return getattr(node, part, None)
