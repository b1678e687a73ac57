"""What the reels' counters say of the capstan's: they see the same tape, and lose its direction but not its way.

They take no part in the fit, since they err by a count at each reversal. But over a whole record the way of the tape by
the capstan's encoder and by either reel must agree within what the owner may err in the radii. If it does not, by the
same factor for both, it is the encoder's: a wheel whose radius is off, or lines that are not as many as is said.

Source: thesis 5.2 for radii from counts; 7.1.3 for the reels' sensors.
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.model import Model
from rtctl.diagnose.simulate import Simulator

FEWEST = 100.0  # counts of a reel, below which its way says little
REVERSAL = 0.3  # variance that a reversal adds, counts^2
SURE = 3.0  # standard deviations


class Factor(NamedTuple):
    """How much too large the encoder reads, and its 90 % interval."""

    relative: float
    low: float
    high: float


def factor(sim: Simulator, model: Model, owner: Model) -> Factor | None:
    """The encoder's factor as both reels tell it; None where they bear the encoder out, or cannot tell."""
    names = [f"reel{i}_counts" for i in (1, 2)]
    if sim.record.plant != "ivu" or not all(name in sim.channels for name in names):
        return None
    out = sim.run(model)
    if not np.isfinite(out).all():
        return None
    turns = np.count_nonzero(np.diff(np.sign(np.diff(out[:: max(1, round(0.02 / sim.record.dt)), 0]))))
    relatives, errors = [], []
    for i, name in enumerate(names, 1):
        told, seen = float(sim.record.y[name][-1]), float(out[-1, sim.channels.index(name)])
        if told < FEWEST:
            return None
        relatives.append(model.base[f"R{i}"] * seen / (owner.base[f"R{i}"] * told) - 1.0)
        errors.append(float(np.sqrt(1.0 + REVERSAL * turns)) / told)
    a, b = relatives
    allowed = [sim.case.tolerance(f"R{i}") + SURE * error for i, error in enumerate(errors, 1)]
    if a * b <= 0.0 or abs(a) < allowed[0] or abs(b) < allowed[1] or abs(a - b) > sum(allowed):
        return None
    spread = 1.645 * float(np.hypot(*(x / np.sqrt(3.0) for x in allowed))) / 2.0
    middle = 0.5 * (a + b)
    return Factor(middle, middle - spread, middle + spread)
