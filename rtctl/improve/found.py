"""Input of an improvement: machine, law, and every effect of a diagnosis with its interval.

A model is a config: `model.yaml` of `rtctl diagnose`, or one of the user's own with effects in `plant.physics`. A
diagnosis is the folder with diagnosis.json and model.yaml, or the bundle that holds it.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import load_yaml
from rtctl.machines import OWN, class_of
from rtctl.plants.physics import TERMS

MODEL, RESULT, FOLDER = "model.yaml", "diagnosis.json", "diagnosis"
NOTHING: Mapping[str, Any] = {}
UNSURE = 0.1  # half width of the interval of a size, as a share of it, where no interval is known


class Effect(NamedTuple):
    """An effect of the model."""

    number: int  # in plant.physics
    entry: Any  # settings
    ends: tuple[dict[str, float], ...]  # parameters at the low and high end of its size
    words: str
    interval: str  # the size with its interval, for people

    @property
    def term(self) -> Any:
        """Its term."""
        return TERMS[self.entry.term]


class Found(NamedTuple):
    """A machine with its effects and their source."""

    config: Any  # law, reference and fitted model
    effects: tuple[Effect, ...]
    unnamed: bool  # the diagnosis reports a missing force without a name
    source: str


def load(path: Path, config: str | None, reference: str | None) -> Found:
    """Read a model, a diagnosis, or a bundle with its diagnosis; `config`, if given, supplies the law.

    Raises UserError for a path that is none of these, and NoAnswer where there is neither an effect nor a law.
    """
    file, result = _files(path)
    made = _config(file, config)
    if reference is not None:
        from rtctl.config.yaml_file import find

        model = type(made).model_fields["reference"].annotation
        assert model is not None
        made = made.model_copy(update={"reference": load_settings(find(reference), model, [])})
    told = json.loads(result.read_text("utf-8")) if result is not None else {}
    return of_config(made, str(path), told)


def of_config(config: Any, source: str, told: Mapping[str, Any] = NOTHING) -> Found:
    """Effects in `plant.physics` of a config, with the intervals `told` of a diagnosis, as in diagnosis.json."""
    sizes = {(e["name"], e["node"]): e["parameters"] for e in told.get("effects", ())}
    effects = tuple(_effect(i, entry, sizes) for i, entry in enumerate(config.plant.physics))
    return Found(config, effects, told.get("verdict") == "unnamed", source)


def _files(path: Path) -> tuple[Path, Path | None]:
    """Model and verdict."""
    if path.is_file():
        beside = path.with_name(RESULT)
        return path, beside if path.name == MODEL and beside.is_file() else None
    for folder in (path, path / FOLDER):
        if (folder / MODEL).is_file():
            return folder / MODEL, folder / RESULT if (folder / RESULT).is_file() else None
    if not path.exists():
        raise UserError(f"{path}: there is no such file or folder; give a bundle that was diagnosed, or a model.yaml")
    raise UserError(f"{path}: there is no {MODEL} in it; `rtctl diagnose {path}` writes one")


def _config(file: Path, config: str | None) -> Any:
    """The model's config, with law, loop and reference of another where one is given."""
    from rtctl.config.yaml_file import find

    document = load_yaml(file)
    kind = class_of(document.data)
    if kind is None:
        raise UserError(f"{file}: machine: is missing; a model is a config with bodies, joints, drives and sensors")
    if config is None:
        made = load_settings(file, kind, [], OWN)
        if not getattr(made.law.position, "gain", 1.0):
            raise NoAnswer(f"{file}: it has no law that moves the machine; give the config that has it with --config")
        return made
    own = load_yaml(find(config))
    model = class_of(own.data)
    if model is None or model.model_fields["machine"].annotation != kind.model_fields["machine"].annotation:
        raise UserError(f"--config {config}: it is of another kind of machine than {file}")
    base = load_settings(find(config), model, [], OWN)
    fitted = load_settings(file, kind, [], OWN)
    return base.model_copy(update={"machine": fitted.machine, "plant": fitted.plant})


def _effect(number: int, entry: Any, sizes: dict[tuple[str, str], Any]) -> Effect:
    term = TERMS[entry.term]
    told = sizes.get((entry.term, entry.node), {})
    name = next(iter(told), None) or _size(term)
    value = getattr(entry, name, None) if name is not None else None
    if name is None or not isinstance(value, float):
        return Effect(number, entry, (), f"{entry.term} at {entry.node}", "")
    low, high, unit = value * (1 - UNSURE), value * (1 + UNSURE), ""
    said = "taken to be"
    if name in told:
        interval = told[name]
        ends_told = interval.get("ci90") or (None, None)
        low, high = _number(ends_told[0], low), _number(ends_told[1], high)
        unit, said = str(interval.get("unit", "")), "90 %"
        factor = value / interval["value"] if interval.get("value") else 1.0  # unit of the report to the entry's
        low, high = low * factor, high * factor
    ends = tuple({name: end} for end in (low, high) if _allowed(entry, name, end))
    words = f"{name} {value:.4g}, {said} {low:.4g} to {high:.4g} {unit}".rstrip()
    return Effect(number, entry, ends, f"{entry.term} at {entry.node}", words)


def _size(term: Any) -> str | None:
    """First parameter of a term's search, else of its typical ranges."""
    return next((part.name for part in term.search if hasattr(part, "name")), next(iter(term.typical), None))


def _allowed(entry: Any, name: str, value: float) -> bool:
    try:
        type(entry).model_validate({**entry.model_dump(), name: value})
    except ValueError:
        return False
    return True


def _number(value: Any, otherwise: float) -> float:
    return float(value) if isinstance(value, int | float) else otherwise


def with_size(config: Any, effect: Effect, values: dict[str, float]) -> Any:
    """The config whose plant has an effect with these parameters."""
    return set_paths(config, {f"plant.physics.{effect.number}.{key}": value for key, value in values.items()})
