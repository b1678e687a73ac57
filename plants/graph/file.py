"""Description of a machine in a YAML file: a config with `machine:`, or bodies, joints, drives and sensors alone.

`tolerance:` and `physics:` (or `plant.physics`) of the file give the prior and the known terms of the nominal model.
"""

from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError, nearest
from rtctl.config.yaml_file import Document, find, load_yaml
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import layout
from rtctl.plants.graph.term_units import entry_in_si
from rtctl.plants.physics import TERMS

PARTS = ("bodies", "joints", "drives", "sensors", "mechanics")
CARRIED = ("delay_samples", "inputs", "problem", "group", "per_recording", "notes")  # keys that case.json has too
WRITES = {"next_tick": 1.0, "same_tick": 0.0}  # loop.write -> samples from a command until it acts


class Believed(NamedTuple):
    """Nominal model of a YAML file: description, known physics and tolerance."""

    machine: Description
    physics: tuple[dict[str, Any], ...]  # entries of a `physics:` list, SI
    tolerance: dict[str, Any]  # by dotted path; empty where the file has none
    case: dict[str, Any]  # further keys that a case.json has too


def read_machine(path: Path | str) -> Believed:
    """Machine, known physics and tolerance of a YAML file: a config with `machine:`, or a bare description.

    Raises UserError with file, line and remedy.
    """
    file = find(path)
    document = load_yaml(file)
    return checked(document.data, document)


def is_bare(data: Any) -> bool:
    """Whether plain data are a description alone, without the other keys of a config."""
    return isinstance(data, dict) and "machine" not in data and any(part in data for part in PARTS)


def checked(data: Any, document: Document) -> Believed:
    """Nominal model of plain data. Raises UserError as `read_machine`."""
    if not isinstance(data, dict):
        raise UserError(f"{document.path} holds no keys; a description has bodies, joints, drives and sensors")
    given, at = (
        ({part: data[part] for part in PARTS if part in data}, ())
        if is_bare(data)
        else (data.get("machine"), ("machine",))
    )
    if not isinstance(given, dict):
        said = f"machine is {given!r}" if "machine" in data else "machine is missing"
        raise UserError(
            f"{_where(document, at)}: {said}; a description has bodies, joints, drives and sensors below machine"
        )
    try:
        machine = Description.model_validate(given)
        layout(machine)
    except ValidationError as error:
        where = lambda path: f"{_where(document, (*at, *path))}: {'.'.join(at)}".removesuffix(": ")  # noqa: E731
        raise UserError(sentences(error, Description, given, where, document.texts)) from None
    except ValueError as error:
        raise UserError(f"{_where(document, at)}: {error}") from None
    plant = data.get("plant")
    physics = data.get("physics", plant.get("physics") if isinstance(plant, dict) else None)
    tolerance = data.get("tolerance")
    if tolerance is not None and not isinstance(tolerance, dict):
        tolerance = {"default": tolerance}
    return Believed(
        machine,
        _physics(physics, document, machine),
        dict(tolerance or {}),
        _carried(data),
    )


def _carried(data: dict[str, Any]) -> dict[str, Any]:
    """Keys that a case.json has too; a config says by `loop.write` when a command acts."""
    out = {key: data[key] for key in CARRIED if key in data}
    loop = data.get("loop")
    write = loop.get("write") if isinstance(loop, dict) else None
    if "delay_samples" not in out and write in WRITES:
        out["delay_samples"] = WRITES[write]
    return out


def _physics(given: Any, document: Document, machine: Description) -> tuple[dict[str, Any], ...]:
    if given is None:
        return ()
    at = ("physics",) if ("physics",) in document.lines else ("plant", "physics")
    if not isinstance(given, list):
        raise UserError(f"{_where(document, at)}: physics is a list of terms, each with term, node and its numbers")
    out = []
    for i, entry in enumerate(given):
        here = (*at, i)
        name = entry.get("term") if isinstance(entry, dict) else None
        if name not in TERMS:
            near = nearest(str(name), TERMS)
            hint = f"; did you mean '{near}'?" if near else "; `rtctl physics` lists them"
            raise UserError(f"{_where(document, here)}: physics.{i}.term: there is no term {name!r}{hint}")
        settings = TERMS[name].settings
        try:
            found = settings.model_validate(entry_in_si(machine, entry))
        except ValidationError as error:
            where = lambda path, here=here: f"{_where(document, (*here, *path))}: {'.'.join(map(str, here))}"  # noqa: E731
            raise UserError(sentences(error, settings, entry, where, document.texts)) from None
        except ValueError as error:
            raise UserError(f"{_where(document, here)}: physics.{i}.{error}") from None
        out.append({"term": name, **found.model_dump(mode="json", exclude_defaults=True)})
    return tuple(out)


def _where(document: Document, at: tuple) -> str:
    line = document.line(at)
    return f"{document.path}:{line}" if line else document.path
