"""Bumpless transfer: when gains change or a law starts, its output does not jump.

At the change the difference to the output before is added; then it fades.

    offset = u_before - u            at a change
    offset *= exp(-dt / tau)         after

Source: Astrom & Hagglund, PID Controllers (1995), section 3.6.
"""

from math import exp
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class BumplessSettings(Settings):
    tau: float = quantity(0.1, unit="s", gt=0, help="time in which the old output fades to a third")


class BumplessParams(NamedTuple):
    decay: float  # of the offset, per tick


BUMPLESS_STATE = state(offset=float)  # V


def build(settings: BumplessSettings, dt: float) -> BumplessParams:
    """Decay for a tick of `dt` s."""
    return BumplessParams(exp(-dt / settings.tau))


@tick
def step(p, s, u, changed, u_before):
    """`u` V plus the fading offset. `changed` is 1 at the tick of a change, `u_before` the output before it, V."""
    if changed != 0:
        s.offset = u_before - u
    else:
        s.offset *= p.decay
    return u + s.offset


@tick
def reset(p, s):
    """Drop the offset at once."""
    s.offset = 0.0
