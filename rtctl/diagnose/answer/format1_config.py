"""Model of a machine of exchange format 1 as its config, and back: `rtctl run` and `rtctl plant` accept the config.

For a recording by rtctl, `plant.parameters` and `plant.physics` of its config are replaced. For any other recording the
config is made from its case (see `config_from_case`).
"""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rtctl.case.format1 import exchange_of
from rtctl.case.quantities import of_case
from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError
from rtctl.config.fields import Shape, fill
from rtctl.config.files import write_text
from rtctl.config.load import load_settings, to_yaml
from rtctl.config.yaml_file import find, load_yaml
from rtctl.diagnose.answer.config_from_case import carried
from rtctl.diagnose.answer.torque_ripple_map import Turn
from rtctl.diagnose.model.by_symbol import Model
from rtctl.diagnose.record.format1 import Record
from rtctl.idiom import Settings
from rtctl.machines.exchange import digits
from rtctl.own.files import ForeignError, OwnError, is_own, refuse_plant
from rtctl.own.model import without_code
from rtctl.own.term import texts
from rtctl.plants.physics import TERMS

WIDTH = 110  # characters of a comment line


def to_config(model: Model, record: Record, config: dict[str, Any] | None = None) -> dict[str, Any]:
    """Config of the machine with the model as plain data, SI, values with six significant digits.

    `config` is the entry `config` in case.json of a recording by rtctl. Raises UserError where a value is out of its
    bounds.
    """
    return _settings_data(model, record, config)[0]


def write_model(
    model: Model,
    record: Record,
    path: Path | str,
    config: dict[str, Any] | None = None,
    left_out: Sequence[str] = (),
) -> Path:
    """Path of the config, written as YAML under a head with its source and omissions; arguments as for `to_config`.

    `left_out` has a sentence on each fitted number that is omitted because it does not improve the prediction. Raises
    UserError where a value is out of its bounds, the machine cannot be built, or the file cannot be written.
    """
    from rtctl import machines

    data, left = _settings_data(model, record, config)
    own = data.get("own", {}) | texts(entry["term"] for entry in data["plant"]["physics"])
    data = {**data, "own": own} if own else data
    try:
        kind, data = machines.widened(data)
        settings = _checked(data, kind)
        machines.build(settings)
    except OwnError as error:
        terms = any(is_own(entry["term"]) for entry in data["plant"]["physics"])
        if not isinstance(error.__cause__, ForeignError) or terms:
            raise UserError(str(error)) from None
        kind, data = without_code(machines.CONFIGS[model.kind], data)  # without the code of a law in the data
        settings = _checked(data, kind)
    except ValueError as error:
        raise UserError(f"the model cannot be run: {error}") from error
    path = Path(path)
    try:
        write_text(path, _head(model, record, config is not None, left, left_out) + to_yaml(settings))
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
    return path


def write_turn(found: Turn, path: Path | str) -> Path:
    """Path of the torque over one turn, written as a table: angle in rad, torque and half its 95 % band in Nm, visits.

    Unvisited places have no torque. Raises UserError where the file cannot be written.
    """
    path = Path(path)
    rows = zip(found.angle, found.torque, found.band, found.visits, strict=True)
    text = "".join(f"{a:.6f},{_number(y)},{_number(half)},{n}\n" for a, y, half, n in rows)
    try:
        write_text(path, "angle_rad,torque_Nm,band_Nm,visits\n" + text)
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
    return path


def _number(value: float) -> str:
    return f"{value:.6g}" if math.isfinite(value) else ""


def read_model(path: Path | str, record: Record) -> Model:
    """Model of the recorded machine from the `plant` section of any config.

    `path` is a file or the name of a shipped config. Raises UserError where the config is of another machine.
    """
    from rtctl import machines

    file = find(str(path))
    data = load_yaml(file).data
    kind = data.get("machine") if isinstance(data, dict) else None
    if kind not in machines.CONFIGS:
        raise UserError(f"{path}: machine is {kind!r}; it should be {record.plant}, as in the bundle")
    if kind != record.plant:
        raise UserError(f"{path}: machine is {kind}, and the bundle was recorded on the {record.plant}")
    refuse_plant(data, f"{path}: ")
    plant = load_settings(file, machines.CONFIGS[kind], widen=machines.OWN_PLANT).plant
    base = exchange_of(kind).symbols(plant)
    return Model(kind, base, tuple(plant.physics), of_case(record.case))


def plant_section(model: Model) -> dict[str, Any]:
    """Keys `parameters` and `physics` of the `plant` of a config as plain data, SI, with all digits."""
    exchange = exchange_of(model.kind)
    base = exchange.settings(model.base)
    return {
        "parameters": {name: base[name] for name in exchange.parameters.model_fields if name in base},
        "physics": [term.model_dump(mode="json") for term in model.terms],
    }


def _settings_data(model: Model, record: Record, config: dict[str, Any] | None) -> tuple[dict[str, Any], list[str]]:
    if model.kind != record.plant:
        raise UserError(f"the model is one of the {model.kind} and the recording one of the {record.plant}")
    parameters = _parameters(model)
    data, left = (dict(config), []) if config is not None else carried(model, record)
    plant = dict(data.get("plant") or {})
    plant["parameters"] = parameters
    plant["physics"] = [entry_of(term) for term in model.terms]
    return {**data, "machine": model.kind, "plant": plant}, left


def _parameters(model: Model) -> dict[str, float]:
    """All parameters of the plant, SI: the config then needs no named set and no default."""
    exchange = exchange_of(model.kind)
    base, fields = exchange.settings(model.base), exchange.parameters
    absent = [name for name, field in fields.model_fields.items() if name not in base and field.default]
    if absent:
        raise UserError(f"the model of the {model.kind} lacks {', '.join(absent)}; a fit or case.json should say it")
    values = {name: digits(base[name]) for name in fields.model_fields if name in base}
    _checked(values, fields, "parameters")
    return values


def entry_of(term: Settings) -> dict[str, Any]:
    """Entry of `physics:` with the settings that differ from the defaults of the term."""
    entry: dict[str, Any] = {"term": term.term, "node": term.node}  # type: ignore[attr-defined]
    settings = TERMS[entry["term"]].settings
    for name, field in settings.model_fields.items():
        if name in entry:
            continue
        value = _plain(getattr(term, name))
        if field.is_required() or value != _plain(field.get_default(call_default_factory=True)):
            entry[name] = value
    _checked(entry, settings, f"{entry['term']} at {entry['node']}")
    return entry


def _plain(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (bool, str, int)):
        return value
    return digits(float(value))


def _checked(data: dict[str, Any], model: type[Settings], where: str = "the model") -> Any:
    try:
        return model.model_validate(fill(Shape(model, model=model), data))
    except ValidationError as error:
        raise UserError(sentences(error, model, data, lambda path: where)) from None


def _head(model: Model, record: Record, own: bool, left: list[str], left_out: Sequence[str] = ()) -> str:
    """Comment lines on top of the file."""
    seconds = len(record.t) * record.dt
    lines = [f"The {model.kind} fitted to a recording of {seconds:.3g} s: plant.parameters and plant.physics are new."]
    if own:
        lines.append("All else is as it was when the recording was made.")
    else:
        lines.append(
            "All else is from case.json of the recording, and from the shipped config where case.json has no value."
        )
    if left:
        lines += ["Not carried over:", *(f"- {words}" for words in left)]
    if left_out:
        lines += ["Found, but left out because it does not predict better:", *(f"- {words}" for words in left_out)]
    wrapped = [part for line in lines for part in textwrap.wrap(line, WIDTH, subsequent_indent="  ")]
    return "".join(f"# {line}\n" for line in wrapped)
