"""Messages for pydantic's validation errors, one line each, with the value as the person wrote it."""

import re
from collections.abc import Callable
from typing import Any

from pydantic import ValidationError

from rtctl.config.fields import Shape, child, literals, unknown
from rtctl.config.units import example

MOST = 20  # lines of a message
BOUNDS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
    "multiple_of": ("multiple_of", "a multiple of"),
}
MAPPINGS = ("model_type", "dict_type", "model_attributes_type", "dataclass_type", "mapping_type")
LISTS = ("list_type", "tuple_type")
NUMBERS = ("float_type", "float_parsing")
WHOLES = ("int_type", "int_parsing", "int_from_float", "int_parsing_size")


def sentences(
    error: ValidationError,
    model: Any,
    data: Any,
    where: Callable[[tuple], str] | None = None,
    texts: dict[tuple, str] | None = None,
) -> str:
    """Message with one line for each mistake, at most 20, with `where(path)` in front.

    `data` are the validated data, `texts` the numbers as they were written.
    """
    lines = []
    for entry in error.errors(include_url=False):
        path, place, owner = _walk(model, entry["loc"])
        if entry["type"] == "value_error":
            path, entry["ctx"]["error"] = _inner(path, str(entry["ctx"]["error"]), data)
        at, what = _what(entry, path, place, owner, data, texts or {})
        name = ".".join(str(part) for part in at)
        prefix = where(path) if where else ""
        if prefix.startswith(f"--set {name}="):
            name = ""  # the prefix has it already
        lines.append(": ".join(part for part in (prefix, name, what) if part))
    lines = list(dict.fromkeys(lines))
    more = [f"and {len(lines) - MOST} more"] if len(lines) > MOST else []
    return "\n".join([*lines[:MOST], *more])


def _walk(model: Any, loc: tuple) -> tuple[tuple, Shape, Shape]:
    """Path in the data for pydantic's location, without the chosen words of unions; its shape and the one above."""
    place = owner = Shape(model, model=model)
    path: list = []
    for part in loc:
        if place.choices and part in place.choices:
            place = owner = Shape(place.choices[part], model=place.choices[part])
            continue
        if place.model is None and place.item is None and place.each is None and not isinstance(part, int):
            continue  # pydantic's name of a union's member
        owner, place = place, child(place, part) or Shape(None)
        path.append(part)
    return tuple(path), place, owner


def _inner(path: tuple, sentence: str, data: Any) -> tuple[tuple, str]:
    """Path and sentence of a check of a group, which may begin with a key: "physics.0.node: no such node"."""
    match = re.match(r"([\w-]+(?:\.[\w-]+){0,9})(: (?=.)| is missing)", sentence[:200], re.ASCII)
    if match is None:
        return path, sentence
    parts = [int(part) if part.isdigit() else part for part in match[1].split(".")]
    absent = object()
    if match[2] == ": " and _raw(data, (*path, *parts), absent) is not absent:
        return (*path, *parts), sentence[match.end() :]
    known = len(parts) - 1  # for a missing key the nearest key above
    while known and _raw(data, (*path, *parts[:known]), absent) is absent:
        known -= 1
    return (*path, *parts[:known]), sentence[len(".".join(match[1].split(".")[:known])) + (known > 0) :]


def _what(entry: Any, path: tuple, place: Shape, owner: Shape, data: Any, texts: dict[tuple, str]) -> tuple[tuple, str]:
    """Path that the message names, and the message."""
    kind, context = entry["type"], entry.get("ctx", {})
    value = short(texts[path]) if path in texts else show(_raw(data, path, entry["input"]))
    unit = place.unit or ""
    if kind == "extra_forbidden":
        return path, f"unknown key; {unknown(str(path[-1]), owner.model.model_fields if owner.model else ())}"
    if kind == "missing":
        return path[:-1], _missing(path[-1], place, data)
    if kind == "union_tag_not_found":
        return path, f"missing key '{place.tag}': {', '.join(place.choices)}"
    if kind == "union_tag_invalid":
        return (*path, place.tag), _not_one_of(context["tag"], place.choices)
    if kind == "literal_error":
        return path, _not_one_of(_raw(data, path, entry["input"]), literals(place.annotation) or [context["expected"]])
    if kind == "value_error":
        return path, str(context["error"])
    if kind in BOUNDS:
        name, words = BOUNDS[kind]
        own = value if isinstance(_raw(data, path, None), str) else f"{value} {unit}".strip()
        return path, f"{own} is out of bounds: it must be {words} {context[name]:g} {unit}".strip()
    if kind in NUMBERS:
        want = f"a number with a unit such as '{example(unit)}', or just a number in {unit}" if unit else "a number"
        return path, f"expected {want}, not {value}"
    if kind == "finite_number":
        return path, f"{value} is not finite"
    if kind in WHOLES:
        return path, f"expected a whole number, not {value}"
    if kind in ("bool_type", "bool_parsing"):
        return path, f"expected true or false, not {value}"
    if kind == "string_type":
        return path, f"expected text, not {value}; put it in quotes"
    if kind == "string_pattern_mismatch":
        return path, f"{value} does not match {context['pattern']}"
    if kind in MAPPINGS:
        known = place.model.model_fields if place.model else ([place.tag] if place.tag else ())
        such = f" such as {', '.join(list(known)[:4])}" if known else ""
        return path, f"expected keys{such}, not {value}"
    if kind in LISTS:
        return path, f"expected a list, not {value}"
    if kind == "too_long":
        return path, f"has {context['actual_length']} items; {context['max_length']} are the most"
    if kind == "too_short":
        return path, f"has {context['actual_length']} items; it needs {context['min_length']}"
    return path, f"{entry['msg'][:1].lower()}{entry['msg'][1:]}, not {value}"


def show(value: Any) -> str:
    """Text of a value as a person wrote it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "keys with values" if value else "{}"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    return short(repr(value))


def short(text: str) -> str:
    """The text, cut to 60 characters."""
    return text if len(text) <= 60 else f"{text[:57]}..."


def _missing(name: Any, place: Shape, data: Any) -> str:
    if isinstance(name, int):
        return f"item {name} is missing"
    help = place.field.description if place.field is not None else None
    about = ", ".join(part for part in (help, f"in {place.unit}" if place.unit else None) if part)
    return f"missing key '{name}'" + (f" ({about})" if about else "")


def _not_one_of(value: Any, words: Any) -> str:
    known = [str(word) for word in words]
    sentence = f"{show(value)} is not one of {', '.join(known)}"
    near = unknown(str(value), known)
    return f"{sentence}; {near}" if near.startswith("did") else sentence


def _raw(data: Any, path: tuple, otherwise: Any) -> Any:
    """Data at a path, before any conversion; `otherwise` where there are none."""
    for part in path:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return otherwise
    return data
