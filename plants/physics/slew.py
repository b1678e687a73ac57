"""Rate limit of a drive: the slope of its output is bounded.

Source: Slotine & Li, Applied Nonlinear Control (1991), 5.2; Duda, Prediction of pilot-in-the-loop oscillations due to
rate saturation, J. Guidance, Control and Dynamics 20 (1997). Solomon, The monolithic op amp, IEEE J. Solid-State
Circuits 9 (1974) for the stage whose current bends towards its limit.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.drive import ramp
from rtctl.plants.physics.search import Limit, Shape
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

FAR = 20.0  # from which on tanh is 1 in double precision


class SlewSettings(Settings):
    """Without effect while rate exceeds the slope of the command. With tau small steps are delayed too, and the slope
    approaches its limit smoothly."""

    term: Literal["drive.slew"] = "drive.slew"
    node: Node
    rate: float = quantity(unit="V/s", gt=0, le=1e9, help="largest rate of the output")
    tau: float = quantity(0.0, unit="s", ge=0, le=10, help="time constant of small steps; 0 for a sharp limit")


class SlewParams(NamedTuple):
    step: float  # V, in one substep
    bend: float  # V behind the command, by which the rate bends; 0 where it does not
    decay: float  # substeps in a time constant, inverse


SLEW_STATE = state(u=float)


def build_slew(settings: SlewSettings, h: float) -> SlewParams:
    """Largest change in a substep of `h` s."""
    tau = settings.tau
    return SlewParams(settings.rate * h, settings.rate * tau, h / tau if tau > 0.0 else 0.0)


@tick
def slew(p, s, u):
    """Mean volts at the driver over a substep at a command of `u` volts."""
    if p.bend == 0.0:
        return ramp(s, u, p.step)
    before = (u - s.u) / p.bend
    after = math.copysign(bent(abs(before), p.decay), before)
    s.u = u - p.bend * after
    return u - 0.5 * p.bend * (before + after)


@tick
def bent(z, t):
    """Solution of z' = -tanh z for a z of 0 or more, after the time t: sinh z falls as exp(-t)."""
    if z - t > FAR:
        return z - t
    if z > FAR:
        return math.asinh(0.5 * math.exp(z - t))
    return math.asinh(math.sinh(z) * math.exp(-t))


SLEW = Term(
    name="drive.slew",
    remedies=("limits",),
    words="it follows in ramps: a large step takes longer than a small one",
    equation="|y'| <= rate; or y' = rate tanh((u - y) / (rate tau))",
    source="Slotine & Li 1991, 5.2; Solomon 1974",
    settings=SlewSettings,
    build=build_slew,
    act={"command": "{m}.volts[{c}] = slew.slew({p}, {s}, {m}.volts[{c}])"},
    stands=(stand("drive", "general"),),
    look_alikes={
        "drive.lag": "small and large steps: a lag takes the same time for both, a rate limit changes only large steps",
        "timing.delay": "small and large steps: a delay is the same time for both",
        "drive.saturation": "hold a large command: a limit never reaches it, a rate limit does",
    },
    typical={"rate": (0.2, 0.9)},
    scale={"rate": "largest command"},
    axis="frequency",
    order=26,
    since=2,
    state=SLEW_STATE,
    phrase=Phrase(
        noun="a rate limit",
        head="{here} follows in ramps",
        detail="it changes by no more than {rate}",
        need="large quick changes of the command",
    ),
    check="Command a large step and watch the output of the amplifier; look for a ramp that is set in it.",
    search=(Limit("rate", "pace", (0.2, 0.6)),),
    richer=(Shape("tau", "tick", (2.0,), 20.0),),
    draws={"rate": Draw(0.2, 0.6, "pace")},
)
