"""Keys of a config: JSON Schema for editors, and rows for the documentation."""

import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic_core import PydanticUndefined

from rtctl.config.complaints import show
from rtctl.config.fields import Shape, child, literals, shape
from rtctl.config.units import NUMBER, example
from rtctl.idiom import Settings

DIALECT = "https://json-schema.org/draft/2020-12/schema"
SIGNS = {
    "gt": ">",
    "ge": ">=",
    "lt": "<",
    "le": "<=",
    "min_length": "length >=",
    "max_length": "length <=",
    "pattern": "like",
}


class Row(NamedTuple):
    """One setting. A list's items have [] in the path, the members of a choice the chosen word: position[pd].gain."""

    path: str
    type: str
    unit: str
    default: str  # as in YAML; "" where the key must be given
    bounds: str
    help: str


def json_schema(model: type[Settings]) -> dict[str, Any]:
    """JSON Schema 2020-12 of a config. A quantity is a number in SI or a text with a unit; `unit` names the SI unit."""
    schema = _with_units(model.model_json_schema(mode="validation"))
    return {"$schema": DIALECT, **schema}


def settings_table(model: type[Settings]) -> list[Row]:
    """A row for each setting of a config, in the order of the file, nested ones included."""
    return list(_rows(Shape(model, model=model), "", {}))


def _with_units(node: Any) -> Any:
    """The schema without pydantic's titles, and with a text beside the number of each quantity."""
    if isinstance(node, list):
        return [_with_units(item) for item in node]
    if not isinstance(node, dict):
        return node
    result = {
        key: {name: _with_units(part) for name, part in value.items()}
        if key in ("properties", "$defs")
        else value
        if key in ("default", "const", "enum")
        else _with_units(value)
        for key, value in node.items()
        if key != "title"
    }
    if isinstance(result.get("discriminator"), dict):  # the branches have a default, but a file must name one
        result["required"] = [result["discriminator"]["propertyName"]]
    return _quantity(result) if isinstance(result.get("unit"), str) else result


def _quantity(node: dict[str, Any]) -> dict[str, Any]:
    about: dict[str, Any] = {key: node[key] for key in ("description", "unit", "default") if key in node}
    kinds = node.get("anyOf") or [{key: value for key, value in node.items() if key not in about}]
    text = {"type": "string", "pattern": NUMBER, "examples": [example(node["unit"])]}
    return {**about, "anyOf": [*kinds, text]}


def _rows(place: Shape, path: str, defaults: dict[str, Any]) -> Iterator[Row]:
    for name, field in place.model.model_fields.items():
        at = shape(field.annotation, field)
        here = f"{path}{name}"
        default = defaults.get(name, field.default)
        text = field.description or _about(at)
        yield Row(here, _type(at), at.unit or "", _default(default), bounds(field.metadata), text)
        yield from _below(at, here, default)


def _below(place: Shape, here: str, default: Any = None) -> Iterator[Row]:
    if place.model is not None:
        known = (
            {name: getattr(default, name) for name in type(default).model_fields}
            if type(default) is place.model
            else {}
        )
        yield from _rows(place, f"{here}.", known)
    for word, model in place.choices.items():
        yield from _rows(Shape(model, model=model), f"{here}[{word}].", {})
    if place.item is not None:
        item = child(place, 0)
        assert item is not None
        yield from _below(item, f"{here}[]")
    if place.each is not None:
        yield from _below(shape(place.each), f"{here}.NAME")


def about(model: type[Settings]) -> str:
    """Purpose of a part of a config: first paragraph of the docstring of its class, else of its module."""
    text = model.__doc__ or sys.modules[model.__module__].__doc__ or ""
    return " ".join(text.strip().split("\n\n")[0].split())


def _about(place: Shape) -> str:
    if place.model is not None:
        return about(place.model)
    if place.choices:
        return f"one of several, as {place.tag} says"
    return "says which of several this is" if len(literals(place.annotation)) == 1 else ""


def _type(place: Shape) -> str:
    """Words for the type of a value."""
    words = literals(place.annotation)
    if words:
        return " | ".join(str(word) for word in words)
    if place.choices:
        return f"{place.tag}: {' | '.join(place.choices)}"
    if place.model is not None:
        return "keys"
    if place.item is not None:
        return f"list of {_type(shape(place.item))}"
    if place.each is not None:
        return f"names, each with {_type(shape(place.each))}"
    names = {"float": "number", "int": "whole number", "bool": "true | false", "str": "text"}
    parts = [part.strip() for part in getattr(place.annotation, "__name__", str(place.annotation)).split("|")]
    return " | ".join(names.get(part, part) for part in parts if part != "None")


def _default(value: Any) -> str:
    if value is PydanticUndefined or hasattr(type(value), "model_fields"):
        return ""
    if isinstance(value, str):
        return value
    if value == []:
        return "[]"
    return "none" if value is None else show(value)


def bounds(metadata: list[Any]) -> str:
    """Bounds from pydantic's metadata, as a person would write them."""
    found = []
    for item in metadata:
        for name, sign in SIGNS.items():
            bound = getattr(item, name, None)
            if bound is not None:
                found.append(f"{sign} {bound:g}" if isinstance(bound, (int, float)) else f"{sign} {bound}")
    return ", ".join(found)
