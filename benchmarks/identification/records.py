"""Recordings of machines of one body for all methods: rows to fit, and rows to predict in a free run."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.answer.load import of_bundle
from rtctl.diagnose.evidence.prediction import HELD
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.recording import GraphRecord, levers
from rtctl.trace.bundle import Bundle, load_bundle

G = 9.81  # m/s^2
AROUND = 10  # rows on each side of the start of the free run, for its initial state


class Owner(NamedTuple):
    """Nominal values of the body, SI: the structure of a hand-written fit."""

    inertia: float  # kg or kg m^2
    viscous: float
    dry: float
    weight: float  # Nm, of gravity on an arm: weight * sin(position)


@dataclass(frozen=True)
class Problem:
    """Recording of n rows; the last quarter is predicted."""

    name: str
    dt: float  # s
    force: np.ndarray  # (n,) N or Nm at the body, by nominal gains
    seen: np.ndarray  # (n,) position, rad or m, or speed
    shows_speed: bool
    owner: Owner
    bundle: Bundle
    record: GraphRecord
    first: int  # first row to predict

    @property
    def spread(self) -> float:
        """Standard deviation of the readings."""
        return float(np.std(self.seen))

    @property
    def states(self) -> np.ndarray:
        """Position and speed (n, 2) by local polynomials, for initial states of windows and for regressions."""
        from scipy.signal import savgol_filter

        width = 2 * AROUND + 1
        if self.shows_speed:
            v = savgol_filter(self.seen, width, 3)
            return np.stack([np.cumsum(v) * self.dt, v], axis=1)
        return np.stack([savgol_filter(self.seen, width, 3, d, self.dt) for d in (0, 1)], axis=1)

    def error(self, predicted: np.ndarray) -> float:
        """Rms error of a free run (n - first,) over the standard deviation of the readings; inf where it diverged."""
        e = predicted - self.seen[self.first :]
        return float(np.sqrt(np.mean(e**2)) / self.spread) if np.isfinite(e).all() else float("inf")


def problem(folder: Path) -> Problem:
    """Problem of a bundle with one body and one drive. Raises ValueError for other machines."""
    bundle = load_bundle(folder)
    record = of_bundle(bundle)
    machine, model = record.case.machine, nominal(record.case)
    bodies = [name for name in machine.bodies if not machine.is_frame(name)]
    if len(bodies) != 1 or len(machine.drives) != 1:
        raise ValueError(f"{folder}: {len(bodies)} bodies and {len(machine.drives)} drives; one of each is compared")
    values, head = record.case.values, f"bodies.{bodies[0]}"
    inertia = values.get(f"{head}.inertia") or values.get(f"{head}.mass") or 0.0
    arms = {path.rsplit(".", 1)[0] for path in values if path.startswith(f"{head}.gravity.")}
    weight = sum(G * values[f"{arm}.mass"] * values[f"{arm}.arm"] for arm in arms)
    main = machine.sensors[record.main]
    force = record.u @ np.array(list(levers(model, bodies[0]).values()))
    n = len(record.t)
    return Problem(
        folder.name, record.dt, force, record.y[record.main], main.measures == "speed",
        Owner(inertia, values.get(f"{head}.viscous", 0.0), values.get(f"{head}.dry", 0.0), weight),
        bundle, record, n - round(HELD * n),
    )  # fmt: skip


def rows_of(bundle: Bundle, begin: int, end: int) -> Bundle:
    """Bundle with the rows [begin, end)."""
    return Bundle({name: c[begin:end] for name, c in bundle.columns.items()}, bundle.case, bundle.folder, bundle.units)
