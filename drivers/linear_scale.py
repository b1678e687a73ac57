"""Linear encoder on the carriage: position of the load, not of the motor.

Plant side: one pulse for each half micrometre, quantised by floor. Loop side: counts to metres.

Source: thesis 11.1, Heidenhain LIDA 477 with a resolution of 0.5 um.
"""

import math
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class LinearScaleSettings(Settings):
    pitch: float = quantity(0.5e-6, unit="m", gt=0, le=1e-2, help="travel per count")


class LinearScaleParams(NamedTuple):
    counts_per_metre: float
    metres_per_count: float


LINEAR_SCALE_STATE = state(primed=int, index=int)


def build(settings: LinearScaleSettings, dt: float) -> LinearScaleParams:
    """Parameters, independent of `dt`."""
    return LinearScaleParams(1.0 / settings.pitch, settings.pitch)


@tick
def step(p, s, x):
    """Signed pulses since the last call, at position `x` (m). The first call only stores the position."""
    counts = x * p.counts_per_metre
    if not (abs(counts) < 9e15):  # NaN or beyond what a float resolves
        return 0
    index = math.floor(counts)
    pulses = index - s.index if s.primed != 0 else 0
    s.primed = 1
    s.index = index
    return pulses


@tick
def metres(p, counts):
    """Position in m at signed `counts`."""
    return counts * p.metres_per_count
