"""Model of a described machine as a config, and back: `machine:` with fitted numbers and `plant.physics` with effects.

A config of any described machine, a bare description and the written file are read alike: the model of one diagnosis
can be the nominal model of the next (`rtctl import --machine model.yaml`).
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from rtctl.case.start import is_start
from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.config.load import Dumper
from rtctl.config.units import to_si
from rtctl.config.yaml_file import Document
from rtctl.diagnose.answer.format1_config import entry_of
from rtctl.diagnose.answer.words import value_unit
from rtctl.diagnose.model.model import PHYSICS, GraphModel, own
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.own.term import texts
from rtctl.plants.graph.file import checked
from rtctl.plants.graph.mechanics import code_of

NO_NAME = "machine"
CHANGED = 5e-4  # share of a value: least change that is reported


def to_config(model: GraphModel, record: GraphRecord, config: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Config as plain data with the fitted numbers, each with its unit, and the terms of physics.

    `config` is that of the recorded machine, where rtctl made the recording: its other keys are unchanged.
    """
    case = record.case
    machine = case.machine.model_dump(mode="json", exclude_unset=True)
    for path in case.made:
        _drop(machine, path.split("."))
    values = own(model.base, record.name)
    for path, value in values.items():
        if path in case.made or is_start(path) or path.startswith(PHYSICS):
            continue
        if value != case.values.get(path):
            value = float(f"{value:.6g}")
        _put(machine, path.split("."), _with_unit(value, value_unit(case.machine, path)))
    code = code_of(case.machine)
    if code is not None:  # absolute path of the user's file
        machine["mechanics"]["kind"] = f"{code.file}:{code.name}"
    physics = [entry_of(term) for term in model._replace(base=values).resolved().terms]
    if config is not None:
        plant = {key: value for key, value in dict(config.get("plant") or {}).items() if key != "physics"}
        return {**config, "machine": machine, "plant": {**plant, "physics": physics}}
    name = re.sub(r"[^A-Za-z0-9_-]", "-", case.file.parent.name)[:40] or NO_NAME
    return {
        "name": name,
        "loop": {
            "rate": float(f"{1.0 / record.dt:.9g}"),
            "write": "next_tick" if case.delay_samples >= 0.5 else "same_tick",
        },
        "machine": machine,
        "plant": {"physics": physics},
    }


def write_model(
    model: GraphModel, record: GraphRecord, path: Path | str, config: Mapping[str, Any] | None = None
) -> Path:
    """Path of the config, written as YAML under a head with its source and the changes.

    Raises UserError where the machine could not be read again or the file cannot be written.
    """
    data = to_config(model, record, config)
    code = data.get("own", {}) | texts(entry["term"] for entry in data["plant"]["physics"])
    data = {**data, "own": code} if code else data
    checked(data, Document(data, path=str(path)))
    text = _head(model, record) + yaml.dump(data, Dumper=Dumper, sort_keys=False, allow_unicode=True, width=120)
    try:
        write_text(Path(path), text)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
    return Path(path)


def _put(data: Any, path: list[str], value: Any) -> None:
    *outer, last = path
    for key in outer:
        data = data[int(key)] if isinstance(data, list) else data.get(key)
        if data is None:
            return  # a default that the case does not contain
    if last in data:
        data[last] = value


def _drop(data: Any, path: list[str]) -> None:
    *outer, last = path
    for key in outer:
        data = data[key]
    data.pop(last, None)


def _with_unit(value: float, unit: str) -> float | str:
    """Number with its unit; bare where a config does not read the unit."""
    if not unit:
        return value
    text = f"{value!r} {unit}"
    try:
        return text if abs(to_si(text, unit) - value) <= 1e-12 * abs(value) else value
    except ValueError:
        return value


def _head(model: GraphModel, record: GraphRecord) -> str:
    """Comment lines on top of the file."""
    seconds = len(record.t) * record.dt
    lines = [f"The machine fitted to a recording of {seconds:.3g} s: numbers of `machine` are fitted,"]
    lines.append("effects that were found are in plant.physics. Changed, nominal -> fitted:")
    lines += [
        f"  {path}: {old:.4g} -> {value:.4g} {unit}".rstrip() for path, old, value, unit in changed(model, record)
    ]
    return "".join(f"# {line}\n" for line in lines)


def changed(model: GraphModel, record: GraphRecord) -> list[tuple[str, float, float, str]]:
    """(path, nominal value, fitted value, unit) of each number of the description that a fit moved, SI."""
    case = record.case
    rows = []
    for path, value in own(model.base, record.name).items():
        old = case.values.get(path, value)
        if not is_start(path) and abs(value - old) > CHANGED * abs(old):
            rows.append((path, old, value, value_unit(case.machine, path)))
    return rows
