"""Case of a described machine: exchange format 2, checked."""

import math
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from rtctl.case.checks import FROM_ELSEWHERE, delay_samples, number, sample_rate, strange
from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError, nearest
from rtctl.plants.graph.coupled import felt
from rtctl.plants.graph.description import Description, Input
from rtctl.plants.graph.elements import elements
from rtctl.plants.graph.layout import NOWHERE, Layout, layout
from rtctl.plants.physics import TERMS, nodes, standing

FORMAT = 2
KEYS = (
    "format", "sample_rate", "machine", "delay_samples", "tolerance", "physics", "inputs", "problem", "group",
    "per_recording", "controller", "loop", "controller_known", "notes",
)  # fmt: skip
OPEN_LOOP = "none"  # kind of controller
PROBLEMS = ("driven", "free", "kinematic", "static")
DEFAULT_TOLERANCE = 0.15
EXACT = ("limit", "dac_range", "per_unit", "counts_per_unit", "resolution", "noise")
START = "start.angle"  # e to the angle, rad, by which the zero of a position is off before the weight of a body
FIRST_POSITION, FIRST_SPEED = "start.position", "start.speed"  # of a free response, as START, in units of the record
OWN_START = "start.bodies."  # head of the first position and speed of a body that a spring joins to the others
HELD_PROBLEMS = ("static", "kinematic")  # the main sensor's motion is given
BEGINS = "start"  # start.BODY: the same of each body of mechanics from a file, whose position its motion depends on
START_TOLERANCE = 0.05  # where nobody says: a machine that hangs still stands a little off, by friction and drive
NEVER = ("dac_range", "resolution", "noise", "per_unit", "counts_per_unit", "limit")  # no parameter of the motion


class GraphCase(NamedTuple):
    """What the owner believes of a described machine."""

    machine: Description
    layout: Layout
    values: dict[str, float]  # every number of the description by dotted path, SI
    tolerances: dict[str, float | None]  # by dotted path; None: the value says nothing
    default_tolerance: float | None
    physics: tuple[dict[str, Any], ...]  # terms that the owner knows
    inputs: dict[str, Input]
    problem: str
    delay_samples: float
    sample_rate: float | None  # Hz
    group: str
    per_recording: tuple[str, ...]
    notes: str
    warnings: tuple[str, ...]
    file: Path
    made: tuple[str, ...] = ()  # paths of values that the program took, where nobody gave any
    format: int = FORMAT  # whose names of effects may be given
    plant: str = ""  # kind of plant by which the owner calls the machine: effects stand at its nodes alone
    called: dict[str, str] = {}  # noqa: RUF012  # path -> symbol by which the owner calls it
    config: dict[str, Any] | None = None  # of a recording by our own daemon: plain data of the machine's config
    open_loop: bool = False  # no controller wrote the commands

    def tolerance(self, path: str) -> float:
        """Share by which a value may be wrong; inf where it may be anything."""
        if is_start(path) and path not in self.tolerances:
            rung = path in (FIRST_POSITION, FIRST_SPEED) or path.startswith(OWN_START)
            return math.inf if rung or self.problem == "free" else START_TOLERANCE
        for end in (path, *(path.rsplit(".", n)[0] for n in range(1, path.count(".") + 1))):
            if end in self.tolerances:
                found = self.tolerances[end]
                return math.inf if found is None else found
        if path.rsplit(".", 1)[-1] in EXACT and not path.startswith("physics."):
            return 0.0
        return math.inf if self.default_tolerance is None else self.default_tolerance

    @property
    def fitted(self) -> tuple[str, ...]:
        """Paths of the values that a fit may move, in the order of the description."""
        out = []
        behind = {path for paths in self.machine.symbols.values() for path in paths[1:]}  # they move with the first
        for path, value in self.values.items():
            key = path.rsplit(".", 1)[-1]
            if path in behind or path in self.made:
                continue
            moves = key not in NEVER or path.startswith("physics.")
            if value != 0.0 and moves and self.tolerance(path) > 1e-3 and self._acts(path):
                out.append(path)
        return tuple(out)

    def _acts(self, path: str) -> bool:
        """Whether a number has a part in the motion: the damping of a drive without a bandwidth has none."""
        if is_start(path) or path.startswith("physics."):
            return True
        group, name, *rest = path.split(".")
        if group == "drives" and rest == ["damping"]:
            return self.machine.drives[name].bandwidth_hz is not None
        if group == "bodies" and rest[0] == "reel":  # paper that does not land changes nothing
            return bool(self.values.get(f"bodies.{name}.reel.thickness"))
        if group == "drives" and rest == ["inductance"]:
            return self.machine.drives[name].kind == "voltage"
        return True


def read_case(case: dict[str, Any], folder: Path | str) -> GraphCase:
    """The checked case of the bundle in `folder`. Raises UserError that names the key and what would be right."""
    where = Path(folder) / "case.json"
    given = case.get("machine")
    if not isinstance(given, dict):
        raise UserError(f"{where}: machine is {type(given).__name__}; it should be an object with bodies and sensors")
    warnings = [strange(where, key, "", KEYS) for key in case if key not in KEYS and key not in FROM_ELSEWHERE]
    try:
        machine = Description.model_validate(given)
    except ValidationError as error:
        raise UserError(sentences(error, Description, given, lambda _: f"{where}: machine").splitlines()[0]) from None
    placed = layout(machine)
    values = dict(machine.paths())
    angles = any(s.measures == "position" for s in machine.sensors.values())
    if angles and any(w.incline is None for body in machine.bodies.values() for w in body.weights):
        values[START] = 1.0
    for name in felt(placed, values):
        if any(s.body == name and s.measures == "position" for s in machine.sensors.values()):
            values[f"{BEGINS}.{name}"] = 1.0
    physics = _physics(where, placed, case.get("physics"))
    values |= _numbers(physics)
    problem = case.get("problem", "driven")
    if problem not in PROBLEMS:
        raise UserError(f"{where}: problem is {problem!r}; it should be one of {', '.join(PROBLEMS)}")
    if problem == "free":
        values |= {FIRST_POSITION: 1.0, FIRST_SPEED: 1.0}
    if problem not in HELD_PROBLEMS:
        values |= dict.fromkeys(_own_starts(machine, placed), 1.0)
    tolerances, default = _tolerances(where, case.get("tolerance"), values, warnings)
    differ = _differ(where, case.get("per_recording"), values)
    rate, delay = sample_rate(where, case), delay_samples(where, case)
    if delay is None:
        delay = 0.0
        if machine.drives and problem == "driven":
            warnings.append(f"{where}: delay_samples is missing; 0 is taken")
    return GraphCase(
        machine=machine,
        layout=placed,
        values=values,
        tolerances=tolerances,
        default_tolerance=default,
        physics=physics,
        inputs=_inputs(where, machine, case.get("inputs")),
        problem=problem,
        delay_samples=delay,
        sample_rate=rate,
        group=str(case.get("group") or ""),
        per_recording=differ,
        notes=str(case.get("notes") or ""),
        warnings=tuple(warnings),
        file=where,
        config=_own_config(case),
        open_loop=(case.get("controller") or {}).get("kind") == OPEN_LOOP,
    )


def _own_config(case: dict[str, Any]) -> dict[str, Any] | None:
    config = case.get("config")
    return config if isinstance(config, dict) and isinstance(config.get("machine"), dict) else None


def _tolerances(
    where: Path, given: Any, values: dict[str, float], warnings: list[str]
) -> tuple[dict[str, float | None], float | None]:
    if given is None:
        warnings.append(f"{where}: tolerance is missing; {DEFAULT_TOLERANCE} is taken for every value")
        return {}, DEFAULT_TOLERANCE
    if not isinstance(given, dict):
        raise UserError(f"{where}: tolerance is a {type(given).__name__}; it should be an object of paths and shares")
    out: dict[str, float | None] = {}
    for path, share in given.items():
        found = number(where, f"tolerance.{path}", share)
        if found is not None and found < 0.0:
            raise UserError(f"{where}: tolerance.{path} is {found:g}; it should be 0 or more, or null")
        out[path] = found
        known = any(one == path or one.startswith(f"{path}.") for one in values)
        if path != "default" and not known and not path.startswith("physics."):
            hint = nearest(path, values)
            near = f" (is it '{hint}'?)" if hint else ""
            warnings.append(f"{where}: tolerance.{path} speaks of no value of the machine; it is left out{near}")
    return out, out.pop("default", DEFAULT_TOLERANCE)


def _physics(where: Path, placed: Layout, given: Any) -> tuple[dict[str, Any], ...]:
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


def is_start(path: str) -> bool:
    """Whether a path is of the state at the first row, which each recording has for itself."""
    return path.startswith("start.")


def _own_starts(machine: Description, placed: Layout) -> list[str]:
    """Paths of the first position and speed of every coordinate but that of the followed sensor, which corrects itself:
    a machine that rings as the recording begins is not at rest."""
    if not placed.links:
        return []
    followed = [
        s.body for kind in ("position", "speed") for s in machine.sensors.values() if s.measures == kind and s.body
    ]
    taken = {NOWHERE, *(placed.bodies[str(body)].coordinate for body in followed[:1])}
    out = []
    for name, body in placed.bodies.items():
        if body.coordinate not in taken:
            taken.add(body.coordinate)
            out += [f"{OWN_START}{name}.position", f"{OWN_START}{name}.speed"]
    return out


def _numbers(physics: tuple[dict[str, Any], ...]) -> dict[str, float]:
    """Every number that the owner gives of a known term, by dotted path; zeros and whole numbers by choice are none."""
    out = {}
    for i, entry in enumerate(physics):
        settings = TERMS[str(entry["term"])].settings.model_validate(entry)
        for key in entry:
            value = getattr(settings, key, None)
            if isinstance(value, float) and value != 0.0 and key not in TERMS[str(entry["term"])].counted:
                out[f"physics.{i}.{key}"] = value
    return out


def _differ(where: Path, given: Any, values: dict[str, float]) -> tuple[str, ...]:
    """Paths whose values each recording has for itself."""
    if given is None:
        return ()
    if not isinstance(given, list) or not all(isinstance(path, str) for path in given):
        raise UserError(f"{where}: per_recording should be a list of dotted paths, such as bodies.load.mass")
    out: list[str] = []
    for path in given:
        found = [one for one in values if one == path or one.startswith(f"{path}.")]
        if not found:
            hint = nearest(path, values)
            raise UserError(
                f"{where}: per_recording: there is no value {path}" + (f"; did you mean '{hint}'?" if hint else "")
            )
        out += found
    return tuple(dict.fromkeys(out))


def _inputs(where: Path, machine: Description, given: Any) -> dict[str, Input]:
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
