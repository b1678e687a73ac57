"""Repetitive control over position: the command against an error of every turn, learned turn by turn in motion.

    w[i] += k dt e,  w[i] *= 1 - forget dt             i: the part of a turn that the machine is in, while it moves
    u     = w at x + lead v                            straight line between the parts

Each part of the turn has its own integral, so that the law needs no model of the periodic error. The law acts up to
the crossover of the loop: a ripple of higher frequency needs a lower gain, or a lower speed while it is learned. The
table counts from where the counter is 0; with an index mark the table can be kept for the next start.

Source: Hara, Yamamoto, Omata & Nakano, Repetitive control system, IEEE TAC 33 (1988); over position by Hillerstrom,
IEEE Trans. Control Systems Technology 4 (1996).
"""

from math import floor
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick

PARTS = 128  # of a turn


class RepetitiveSettings(Settings):
    period: float = quantity(unit="rad", gt=0, help="travel after which the error repeats: 2 pi for a turn")
    gain: float = quantity(unit="V/rad/s", ge=0, help="k, of the integral of each part; 0 switches it off")
    lead: float = quantity(0.0, unit="s", ge=0, le=0.1, help="time until a command acts; the table is read then")
    forget: float = quantity(0.0, unit="1/s", ge=0, help="rate at which a part is forgotten while the machine is in it")
    slow: float = quantity(unit="rad/s", gt=0, help="speed below which nothing is learned")


class RepetitiveParams(NamedTuple):
    parts: float  # parts per unit of position
    gain: float  # V per unit of error, per tick
    keep: float  # share that is kept, per tick
    lead: float  # s
    slow: float  # unit/s


REPETITIVE_STATE = state(w=(float, PARTS))  # V


def build(settings: RepetitiveSettings, dt: float) -> RepetitiveParams:
    """Coefficients for a tick of `dt` s."""
    keep = max(1.0 - settings.forget * dt, 0.0)
    return RepetitiveParams(PARTS / settings.period, settings.gain * dt, keep, settings.lead, settings.slow)


@tick
def step(p, s, x, v, e):
    """Command in V at the position `x` with speed `v` of the reference, for the error `e` (rad or m)."""
    at = x * p.parts
    i = floor(at)
    share = at - i
    if abs(v) > p.slow:
        a, b = int(i) % PARTS, int(i + 1) % PARTS
        s.w[a] = p.keep * s.w[a] + (1.0 - share) * p.gain * e
        s.w[b] = p.keep * s.w[b] + share * p.gain * e
    at = (x + p.lead * v) * p.parts
    i = floor(at)
    share = at - i
    return (1.0 - share) * s.w[int(i) % PARTS] + share * s.w[int(i + 1) % PARTS]


@tick
def reset(p, s):
    """Forget the table."""
    for i in range(PARTS):
        s.w[i] = 0.0
