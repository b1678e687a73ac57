"""Known terms of physics and measured inputs of a described machine, beside its description."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError, nearest
from rtctl.plants.graph.description import Description, Input
from rtctl.plants.graph.elements import elements
from rtctl.plants.graph.layout import Layout
from rtctl.plants.physics import TERMS, nodes, standing


def physics(where: Path, placed: Layout, given: Any) -> tuple[dict[str, Any], ...]:
    """Checked entries under the key `physics`. Raises UserError that names the entry and what would be right."""
    if given is None:
        return ()
    if not isinstance(given, list) or not all(isinstance(entry, dict) and "term" in entry for entry in given):
        raise UserError(f"{where}: physics should be a list of objects with 'term', 'node' and the term's parameters")
    there = elements(placed)
    for i, entry in enumerate(given):
        at, name = f"{where}: physics.{i}", str(entry["term"])
        if name not in TERMS:
            hint = nearest(name, TERMS)
            near = f"did you mean '{hint}'?" if hint else "`rtctl physics` lists them"
            raise UserError(f"{at}.term: there is no term '{name}'; {near}")
        settings = TERMS[name].settings
        try:
            settings.model_validate(entry)
        except ValidationError as error:
            raise UserError(f"{at}: {sentences(error, settings, entry).splitlines()[0]}") from None
        if standing(TERMS[name], there, str(entry.get("node"))) is None:
            where_it_can = ", ".join(nodes(TERMS[name], there)) or "nowhere in this machine"
            raise UserError(f"{at}.node: {name} cannot stand at '{entry.get('node')}'; it can at {where_it_can}")
    return tuple(given)


def numbers(entries: tuple[dict[str, Any], ...]) -> dict[str, float]:
    """Numbers of the known terms, by dotted path, without zeros and without the term's `counted` parameters."""
    out = {}
    for i, entry in enumerate(entries):
        settings = TERMS[str(entry["term"])].settings.model_validate(entry)
        for key in entry:
            value = getattr(settings, key, None)
            if isinstance(value, float) and value != 0.0 and key not in TERMS[str(entry["term"])].counted:
                out[f"physics.{i}.{key}"] = value
    return out


def inputs(where: Path, machine: Description, given: Any) -> dict[str, Input]:
    """Checked entries under the key `inputs`, by name. Raises UserError that names the entry and the mistake."""
    if given is None:
        return {}
    if not isinstance(given, dict):
        raise UserError(f"{where}: inputs is a {type(given).__name__}; it should be an object of names and columns")
    out = {}
    for name, entry in given.items():
        try:
            out[name] = Input.model_validate(entry)
        except ValidationError as error:
            raise UserError(f"{where}: inputs.{name}: {sentences(error, Input, entry).splitlines()[0]}") from None
        if out[name].body not in machine.bodies:
            hint = nearest(out[name].body, machine.bodies)
            raise UserError(
                f"{where}: inputs.{name}.body: there is no body '{out[name].body}'"
                + (f"; did you mean '{hint}'?" if hint else "")
            )
    return out
