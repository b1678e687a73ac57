"""Map feedforward: a command over angle or place, from a table.

    u = straight line between the values at ref + lead v               periodic, or held beyond its ends

For cogging, torque ripple, imbalance, a spring or a bump that was measured rather than named. `torque_over_turn.csv` of
a diagnosis holds a map of this kind. The map counts from where the counter is 0.

Source: Holtz & Springob, Identification and compensation of torque ripple in high-precision permanent magnet motor
drives, IEEE Trans. Industrial Electronics 43 (1996).
"""

from math import floor
from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, tick

MOST = 512  # values


class MapFeedforwardSettings(Settings):
    span: float = quantity(unit="rad", gt=0, help="travel that the values cover: 2 pi for a turn")
    start: float = quantity(0.0, unit="rad", help="position of the first value")
    values: list[float] = Field(min_length=2, max_length=MOST, description="V, evenly over the span")
    periodic: bool = Field(default=True, description="it comes back after the span; else the last value is held")
    lead: float = quantity(0.0, unit="s", ge=0, le=0.1, help="time until a command acts; the map is read then")


class MapFeedforwardParams(NamedTuple):
    start: float  # rad or m
    per_unit: float  # values per unit of position
    n: int
    periodic: int
    lead: float  # s
    values: np.ndarray  # V, (MOST,)


def build(settings: MapFeedforwardSettings, dt: float) -> MapFeedforwardParams:
    """Nothing to discretise: only the position counts."""
    n = len(settings.values)
    values = np.zeros(MOST)
    values[:n] = settings.values
    steps = n if settings.periodic else n - 1
    return MapFeedforwardParams(settings.start, steps / settings.span, n, int(settings.periodic), settings.lead, values)


@tick
def step(p, ref, v):
    """Command in V at the reference `ref` (rad or m) with speed `v`."""
    at = (ref + p.lead * v - p.start) * p.per_unit
    i = floor(at)
    share = at - i
    if p.periodic != 0:
        a, b = int(i) % p.n, int(i + 1) % p.n
    else:
        a, b = min(max(int(i), 0), p.n - 1), min(max(int(i) + 1, 0), p.n - 1)
    return (1.0 - share) * p.values[a] + share * p.values[b]
