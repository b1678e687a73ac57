"""LS7084: turns an encoder's A and B into a clock and a direction for an up/down counter.

x4 gives a pulse for every edge of A and B: the count is the floor of the angle in quarter lines. A disc that vibrates
on an edge gives as many ups as downs (the dual one-shots see both), so nothing adds up.

x1 gives a pulse where A rises, up when B is low there and down when B is high. Going back, A rises at the other end of
its high half, so x1 has a hysteresis of three quarters of a line; an edge passed forth and back again counts once.

A one-shot makes every pulse as long as the bias resistor says (0.2 us to hundreds of us), and the input filter takes
only levels that stand for `filter`. Above the rate that follows, counts are lost for good: `s.lost` says how many.

Source: thesis 7.1.1, 7.4; LSI Computer Systems, LS7083/LS7084 data sheet (T_OW <= T_PS). The sheet's filter time hangs
on the supply; 0.2 us is of its order.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick

EPSILON = 1e-9  # of a pulse: rounding of the carried room must not lose a pulse at exactly the highest rate


class Ls7084Settings(Settings):
    lines: int = quantity(2500, unit="", gt=0, le=1_000_000, help="pulses per revolution of the encoder")
    multiply: Literal[1, 4] = Field(4, description="counts per line: x1 or x4, by pin 6")
    pulse_width: float = quantity(1e-6, unit="s", ge=0.2e-6, le=1e-3, help="output pulse, by the bias resistor")
    filter: float = quantity(0.2e-6, unit="s", gt=0, le=1e-3, help="shortest level of A or B that is taken")


class Ls7084Params(NamedTuple):
    counts_per_rev: float
    radians_per_count: float
    quarters_per_radian: float  # edges of A and B
    multiply: int
    highest_rate: float  # pulses/s


LS7084_STATE = state(primed=int, index=int, room=float, lost=int)


def highest_rate(settings: Ls7084Settings) -> float:
    """Pulses per second that the one-shot and the filter let through."""
    return min(1.0 / settings.pulse_width, settings.multiply / (4.0 * settings.filter))


def build(settings: Ls7084Settings, dt: float) -> Ls7084Params:
    """Nothing hangs on `dt`: the steps get their own length."""
    counts_per_rev = float(settings.lines * settings.multiply)
    quarters = 4 * settings.lines / (2 * math.pi)
    return Ls7084Params(
        counts_per_rev, 2 * math.pi / counts_per_rev, quarters, settings.multiply, highest_rate(settings)
    )


@tick
def step(p, s, theta, h):
    """Signed pulses over a substep of `h` s that ends at `theta` (rad). The first call only takes the position."""
    x = theta * p.quarters_per_radian
    if not (abs(x) < 9e15):  # NaN or beyond what a float resolves: no edge to see
        return 0
    quarter = math.floor(x)
    if s.primed == 0:
        s.primed = 1
        s.index = quarter if p.multiply == 4 else quarter // 4
        s.room = 1.0
        return 0
    index = quarter
    if p.multiply == 1:  # up on entering quarter 4n, down on leaving 4n - 2 backwards, as it is in between
        index = min(max(s.index, quarter // 4), (quarter + 2) // 4)
    pulses = index - s.index
    s.index = index
    # A one-shot at rest can fire at once, hence one pulse of room on top of what the time allows.
    room = s.room + p.highest_rate * h
    passed = min(abs(pulses), math.floor(room + EPSILON))
    s.room = min(room - passed, 1.0)
    s.lost += abs(pulses) - passed
    return passed if pulses >= 0 else -passed


@tick
def radians(p, counts):
    """Angle in rad of the encoder at signed `counts`."""
    return counts * p.radians_per_count
