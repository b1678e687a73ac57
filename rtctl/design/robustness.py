"""Margins of the reel unit's loop with a fixed gain over all reel radii.

A full reel has little mass and little damping at the tape, so the loop gain and the resonance of the motor's shaft
both rise with the radius: the margin is least where both reels are full.

Source: thesis 5.2, which expects the worst case at R1 = 40 mm, and chapter 9. The text has no margins over the radii:
its 'stable for the complete range of reel radii' holds, with 1.2 dB of gain margin at 40/40 mm.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.design import margins
from rtctl.design.margins import Margins
from rtctl.machines.profile import REELS
from rtctl.machines.profiles import profile_of

RADII = (0.020, 0.025, 0.030, 0.035, 0.040)  # m


class Map(NamedTuple):
    """Margins over the radius of the reel that pulls and of the other one, each array (n, m)."""

    R_drive: np.ndarray  # (n,) m
    R_other: np.ndarray  # (m,) m
    stable: np.ndarray
    GM: np.ndarray  # dB
    PM: np.ndarray  # deg
    crossover: np.ndarray  # Hz
    M_S: np.ndarray  # dB

    @property
    def worst(self) -> tuple[float, float, float]:
        """Least gain margin in dB, and its radii in m."""
        i, j = np.unravel_index(int(np.argmin(self.GM)), self.GM.shape)
        return float(self.GM[i, j]), float(self.R_drive[i]), float(self.R_other[j])


def over_radii(config: Any, R_drive: Any = RADII, R_other: Any = RADII, motor: int = 1, printed: bool = False) -> Map:
    """Margins for every pair of radii (m), `motor` pulling, as ticked or `printed` as in the thesis.

    Raises UserError where the config is not that of a reel unit.
    """
    drive, other = np.atleast_1d(np.asarray(R_drive, float)), np.atleast_1d(np.asarray(R_other, float))
    rows = [[at(config, a, b, motor, printed) for b in other] for a in drive]

    def table(name: str) -> np.ndarray:
        return np.array([[getattr(cell, name) for cell in row] for row in rows])

    return Map(drive, other, table("stable"), table("GM"), table("PM"), table("f_PM"), table("M_S"))


def at(config: Any, R_drive: float, R_other: float, motor: int = 1, printed: bool = False) -> Margins:
    """Margins at one pair of radii in m, with `motor` (1 or 2) pulling."""
    R1, R2 = (R_drive, R_other) if motor == 1 else (R_other, R_drive)
    return margins.of_config(with_radii(config, R1, R2), motor, printed, quick=True)


def with_radii(config: Any, R1: float, R2: float) -> Any:
    """The config with other reels (m), for its laws and its emulator alike."""
    if not profile_of(config.kind).has(REELS):
        raise UserError(f"machine: {config.kind} has no reels; radii are those of an ivu")
    radii = {"R1": float(R1), "R2": float(R2)}
    parameters = config.plant.parameters.model_copy(update=radii)
    return config.model_copy(
        update={
            "radius": config.radius.model_copy(update=radii),
            "plant": config.plant.model_copy(update={"parameters": parameters}),
        }
    )
