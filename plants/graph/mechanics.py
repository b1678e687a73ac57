"""Mechanics of a machine from a file: the functions M(q) and h(q, v) of M(q) q'' + h(q, v) = F, and their registration.

    machine:
      mechanics: {kind: ./furuta.py:Furuta, parameters: {m: 24 g, d: 64.5 mm}, at: {pendulum: 0 deg}}

The module that loads a file from a path of the user registers its code (rtctl.own.mechanics). A description holds the
name of the code, the hash of its text and its parameters, and never the text.
"""

from collections.abc import Mapping
from types import ModuleType
from typing import Any, NamedTuple

from pydantic import Field, ValidationError

from rtctl.config.units import to_si
from rtctl.idiom import Settings


class Mechanics(NamedTuple):
    """Code of a mechanics file."""

    name: str  # Furuta, of FurutaSettings
    sha256: str  # of the file's text, 16 digits
    module: ModuleType  # with COORDINATES, build, M and h
    settings: type[Settings]
    steps: ModuleType  # the compiled integration around it (coupled.py)
    params: type  # record of a plant with it
    file: str  # path by which the user named it

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates q, in their order."""
        return tuple(self.module.COORDINATES)

    def unit(self, parameter: str) -> str:
        """Unit of a parameter; "" for a bare number."""
        field = self.settings.model_fields.get(parameter)
        extra = field.json_schema_extra if field is not None else None
        return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


class MechanicsSettings(Settings):
    """File of the mechanics that couples the bodies, and its parameters."""

    kind: str = Field(description="file and name in it, ./furuta.py:Furuta; its path is relative to the config")
    sha256: str = Field(default="", description="hash of the file's text; written by the program")
    bodies: list[str] = Field(
        default=[], description="bodies for its coordinates, in their order; same names if absent"
    )
    at: dict[str, float] = Field(
        default={}, description="position of a body at the start, where its sensors show 0, rad or m"
    )
    parameters: dict[str, float] = Field(default={}, description="numbers of the file's settings")


_known: dict[str, Mechanics] = {}  # sha256 -> code that the user gave
_given: dict[str, Mechanics] = {}  # name -> code that the user gave last


def register(mechanics: Mechanics) -> None:
    """Let descriptions use the code of a file that the user named."""
    _known[mechanics.sha256] = mechanics
    _given[mechanics.name] = mechanics


def known(sha256: str) -> Mechanics | None:
    """Code of a text that was registered."""
    return _known.get(sha256)


def code_of(machine: Any) -> Mechanics | None:
    """Code of a description's mechanics; None where it has none."""
    return None if machine.mechanics is None else _known[machine.mechanics.sha256]


def resolved(data: Any) -> Any:
    """The data of `mechanics:` with its code's hash and every parameter in SI.

    Raises ValueError, with the dotted path in front, where no user gave the code or a number does not fit.
    """
    if isinstance(data, str):
        data = {"kind": data}
    if not isinstance(data, Mapping) or not isinstance(data.get("kind"), str):
        return data
    file, _, name = str(data["kind"]).rpartition(":")
    found = _known.get(str(data.get("sha256"))) or _given.get(name)
    if found is None:
        raise ValueError(
            f"mechanics.kind: the code of {data['kind']} is not given, and no code is taken from a bundle; name the "
            f"file by path: --mechanics {file or data['kind']}, or --machine CONFIG of the config that names it"
        )
    given = data.get("parameters") or {}
    try:
        settings = found.settings.model_validate(given)
    except ValidationError as error:
        first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")  # a wrong name explains a lack
        raise ValueError(f"mechanics.parameters.{'.'.join(map(str, first['loc']))}: {_words(first, found)}") from None
    numbers = {key: float(value) for key, value in settings.model_dump().items() if isinstance(value, int | float)}
    return {**data, "sha256": found.sha256, "parameters": numbers, "at": _places(data.get("at"))}


def _words(error: Any, found: Mechanics) -> str:
    if error["type"] == "extra_forbidden":
        return f"{found.name} has no such parameter; it has {', '.join(found.settings.model_fields)}"
    if error["type"] == "missing":
        return f"is missing; {found.name} needs it ({found.unit(str(error['loc'][0])) or 'a number'})"
    return str(error["msg"]).removeprefix("Value error, ")


def _places(given: Any) -> Any:
    """Positions with the unit that each is written in, an angle or a way, in SI."""
    if not isinstance(given, Mapping):
        return given or {}
    out = {}
    for name, value in given.items():
        try:
            out[name] = to_si(value, "rad")
        except ValueError as error:
            try:
                out[name] = to_si(value, "m")
            except ValueError:
                raise ValueError(f"mechanics.at.{name}: {error}") from None
    return out


def check(machine: Any) -> None:
    """Raise ValueError, with the dotted path in front, where the coordinates are no bodies of their own."""
    found = code_of(machine)
    if found is None:
        return
    names = machine.mechanics.bodies or list(found.coordinates)
    if len(names) != len(found.coordinates):
        raise ValueError(
            f"mechanics.bodies: {found.name} has the coordinates {', '.join(found.coordinates)}; give a body for each"
        )
    for name in names:
        if name not in machine.bodies or machine.is_frame(name):
            raise ValueError(
                f"mechanics.bodies: {found.name} moves {', '.join(found.coordinates)}, and there is no body '{name}' "
                "that moves; give the bodies in the order of its coordinates"
            )
    for name, body in machine.bodies.items():
        if body.reel is not None:
            raise ValueError(
                f"bodies.{name}.reel: a machine with mechanics has no reel, whose inertia changes; leave it out"
            )
    for name in machine.mechanics.at:
        if name not in machine.bodies:
            raise ValueError(f"mechanics.at.{name}: there is no such body")


def bodies_of(machine: Any) -> list[str]:
    """Bodies that are coordinates of the mechanics, in the file's order; none where the machine has none."""
    found = code_of(machine)
    return [] if found is None else list(machine.mechanics.bodies or found.coordinates)
