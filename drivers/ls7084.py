"""LS7084 quadrature converter: from an encoder's A and B to clock and direction of an up/down counter.

x4 gives a pulse for every edge of A and B: the count is the floor of the angle in quarter lines. A disc that vibrates
on an edge gives as many pulses up as down (the dual one-shots see both), so no error accumulates.

x1 gives a pulse where A rises, up when B is low and down when B is high. In reverse, A rises at the other end of its
high half, so x1 has a hysteresis of three quarters of a line. An edge passed forwards and back again counts once.

A one-shot sets the length of every pulse by the bias resistor (0.2 us to hundreds of us). The input filter passes only
levels longer than `filter`. Both limit the rate; counts above the limit are lost, and `s.lost` counts them.

Source: thesis 7.1.1, 7.4; LSI Computer Systems, LS7083/LS7084 data sheet (T_OW <= T_PS). In the sheet the filter time
depends on the supply; 0.2 us is of its order.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick

EPSILON = 1e-9  # pulses, against rounding of `room`: no pulse may be lost at exactly the highest rate


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
    """Highest rate of pulses that one-shot and filter pass, 1/s."""
    return min(1.0 / settings.pulse_width, settings.multiply / (4.0 * settings.filter))


def build(settings: Ls7084Settings, dt: float) -> Ls7084Params:
    """Parameters, independent of `dt`: each step gets its own length."""
    counts_per_rev = float(settings.lines * settings.multiply)
    quarters = 4 * settings.lines / (2 * math.pi)
    return Ls7084Params(
        counts_per_rev, 2 * math.pi / counts_per_rev, quarters, settings.multiply, highest_rate(settings)
    )


@tick
def step(p, s, theta, h):
    """Signed pulses over a substep of `h` s that ends at `theta` (rad). The first call only stores the position."""
    x = theta * p.quarters_per_radian
    if not (abs(x) < 9e15):  # NaN, or beyond the resolution of a float
        return 0
    quarter = math.floor(x)
    if s.primed == 0:
        s.primed = 1
        s.index = quarter if p.multiply == 4 else quarter // 4
        s.room = 1.0
        return 0
    index = quarter
    if p.multiply == 1:  # up at entry of quarter 4n, down at exit of 4n - 2 in reverse, else unchanged
        index = min(max(s.index, quarter // 4), (quarter + 2) // 4)
    pulses = index - s.index
    s.index = index
    # A one-shot at rest can fire at once, so one pulse more than the rate allows may pass.
    room = s.room + p.highest_rate * h
    passed = min(abs(pulses), math.floor(room + EPSILON))
    s.room = min(room - passed, 1.0)
    s.lost += abs(pulses) - passed
    return passed if pulses >= 0 else -passed


@tick
def radians(p, counts):
    """Angle in rad of the encoder at signed `counts`."""
    return counts * p.radians_per_count
