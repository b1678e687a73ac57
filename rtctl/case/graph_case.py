"""Case of a described machine: nominal values, their tolerances, and which of them a fit may change."""

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
START_TOLERANCE = 0.05  # relative tolerance of an initial state if none is given; friction and drive shift the rest
NEVER = (
    "dac_range",
    "resolution",
    "noise",
    "per_unit",
    "counts_per_unit",
    "limit",
    "output_limit",
)  # keys that are no parameters of the motion


class GraphCase(NamedTuple):
    """Nominal model of a described machine."""

    machine: Description
    layout: Layout
    values: dict[str, float]  # every number of the description by dotted path, SI
    tolerances: dict[str, float | None]  # relative, by dotted path; None: unlimited
    default_tolerance: float | None
    physics: tuple[dict[str, Any], ...]  # known terms
    inputs: dict[str, Input]
    problem: str
    delay_samples: float
    sample_rate: float | None  # Hz
    group: str
    per_recording: tuple[str, ...]
    notes: str
    warnings: tuple[str, ...]
    file: Path
    made: tuple[str, ...] = ()  # paths of default values that the case does not give
    format: int = FORMAT  # exchange format with the names of effects that may be given
    plant: str = ""  # kind of plant in the case; effects then stand at its nodes only
    called: dict[str, str] = {}  # noqa: RUF012  # path -> symbol in the case
    config: dict[str, Any] | None = None  # plain data of the machine's config, in a recording by rtctl
    open_loop: bool = False  # no controller wrote the commands
    controller: GraphLaw | None = None  # law that wrote one drive's command; None: the recorded command is the input

    def tolerance(self, path: str) -> float:
        """Relative tolerance of a value; inf where it is unlimited."""
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
        """Paths of the values that a fit may change, in the order of the description."""
        out = []
        behind = {path for paths in self.machine.symbols.values() for path in paths[1:]}  # they follow the first path
        for path, value in self.values.items():
            key = path.rsplit(".", 1)[-1]
            if path in behind or path in self.made:
                continue
            moves = key not in NEVER or path.startswith("physics.")
            if value != 0.0 and moves and self.tolerance(path) > 1e-3 and self._acts(path):
                out.append(path)
        return tuple(out)

    def _acts(self, path: str) -> bool:
        """Whether a number affects the motion; the damping of a drive without a bandwidth does not."""
        if is_start(path) or path.startswith("physics."):
            return True
        group, name, *rest = path.split(".")
        if group == "drives" and rest == ["damping"]:
            return self.machine.drives[name].bandwidth_hz is not None
        if group == "bodies" and rest[0] == "reel":  # without paper thickness the reel has no effect
            return bool(self.values.get(f"bodies.{name}.reel.thickness"))
        if group == "drives" and rest == ["inductance"]:
            return self.machine.drives[name].kind == "voltage"
        return True
