"""Inverse of the drive's static curve: the command at which the drive gives the voltage of the law.

    u = straight lines through (wanted, command)       beyond the table on its last line

For a dead band, an offset, another gain for each sign, or a bend. The table rises; a dead band becomes a steep stretch
about zero, whose slope is the factor by which the loop gain rises there.

Source: Tao & Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities (1996), ch. 3.
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, tick

MOST = 64  # points


class InverseCurveSettings(Settings):
    points: list[tuple[float, float]] = Field(
        min_length=2, max_length=MOST, description="pairs of what is wanted and the command that gives it, both rising"
    )


class InverseCurveParams(NamedTuple):
    n: int
    wanted: np.ndarray  # (MOST,) V
    command: np.ndarray  # (MOST,) V


def build(settings: InverseCurveSettings, dt: float) -> InverseCurveParams:
    """Nothing to discretise. Raises ValueError where the table does not rise."""
    table = np.array(settings.points, float)
    if np.any(np.diff(table, axis=0) <= 0):
        raise ValueError("points must rise in both columns from one to the next")
    n, wanted, command = len(table), np.zeros(MOST), np.zeros(MOST)
    wanted[:n], command[:n] = table.T
    return InverseCurveParams(n, wanted, command)


@tick
def step(p, u):
    """Command in V at which the drive gives `u` V."""
    i = 0
    while i < p.n - 2 and p.wanted[i + 1] <= u:
        i += 1
    slope = (p.command[i + 1] - p.command[i]) / (p.wanted[i + 1] - p.wanted[i])
    return p.command[i] + slope * (u - p.wanted[i])
