"""Case of a described machine: what its owner believes, with the tolerance of each number and which a fit may move."""

import math
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.case.controller import GraphLaw
from rtctl.case.start import FIRST_POSITION, FIRST_SPEED, OWN_START, is_start
from rtctl.plants.graph.description import Description, Input
from rtctl.plants.graph.layout import Layout

FORMAT = 2
PROBLEMS = ("driven", "free", "kinematic", "static")
EXACT = ("limit", "output_limit", "dac_range", "per_unit", "counts_per_unit", "resolution", "noise")
START_TOLERANCE = 0.05  # where nobody says: a machine that hangs still stands a little off, by friction and drive
NEVER = (
    "dac_range",
    "resolution",
    "noise",
    "per_unit",
    "counts_per_unit",
    "limit",
    "output_limit",
)  # no parameter of the motion


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
    controller: GraphLaw | None = None  # that wrote the command of one drive; None: the recorded command is the input

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
