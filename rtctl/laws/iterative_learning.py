"""Iterative learning: a command over the time of a move, learned from one run of the move to the next.

    u(t) = straight line between the values, evenly over the move                     played from its start on
    u_j+1 = Q (u_j + L e_j)                                                            between two runs

The values are learned offline (rtctl/improve/learning.py), run by run: nothing changes while the machine moves. They
belong to one reference, which has to begin at one fixed position. Before and after the move they are 0.

Source: Bristow, Tharayil & Alleyne, A survey of iterative learning control, IEEE Control Systems Magazine 26 (2006).
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, tick
from rtctl.laws.reference import PLAY

MOST = 1024  # values


class IterativeLearningSettings(Settings):
    duration: float = quantity(unit="s", gt=0, help="length of the move, from the start of playback")
    values: list[float] = Field(min_length=2, max_length=MOST, description="V, evenly over the move")
    share: float = quantity(1.0, unit="", ge=0, le=1, help="part of it that is added; 0 switches it off")


class IterativeLearningParams(NamedTuple):
    per_tick: float  # values a tick
    n: int
    values: np.ndarray  # V, (MOST,)


def build(settings: IterativeLearningSettings, dt: float) -> IterativeLearningParams:
    """Values for a tick of `dt` s."""
    n = len(settings.values)
    values = np.zeros(MOST)
    values[:n] = settings.share * np.array(settings.values)
    return IterativeLearningParams((n - 1) * dt / settings.duration, n, values)


@tick
def step(p, mode, k, period):
    """Command in V at `k` ticks after playback started, in the reference's `mode`; its `period` is in ticks, 0 for one
    run."""
    if mode != PLAY or k < 0:
        return 0.0
    if period > 0:
        k = k % period
    at = k * p.per_tick
    i = int(at)
    if i >= p.n - 1:
        return 0.0
    share = at - i
    return (1.0 - share) * p.values[i] + share * p.values[i + 1]
