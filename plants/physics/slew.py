"""Rate limit of a drive: its output follows the command no faster than so much a second.

Source: Slotine & Li, Applied Nonlinear Control (1991), 5.2; Duda, Prediction of pilot-in-the-loop oscillations due to
rate saturation, J. Guidance, Control and Dynamics 20 (1997).
"""

from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.drive import ramp
from rtctl.plants.physics.search import Limit
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class SlewSettings(Settings):
    """Without effect while rate is beyond all that the command asks for."""

    term: Literal["drive.slew"] = "drive.slew"
    node: Node
    rate: float = quantity(unit="V/s", gt=0, le=1e9, help="the output changes no faster than this")


class SlewParams(NamedTuple):
    step: float  # V, in one substep


SLEW_STATE = state(u=float)


def build_slew(settings: SlewSettings, h: float) -> SlewParams:
    """Largest change in a substep of `h` s."""
    return SlewParams(settings.rate * h)


@tick
def slew(p, s, u):
    """Mean volts at the driver over a substep at a command of `u` volts."""
    return ramp(s, u, p.step)


SLEW = Term(
    name="drive.slew",
    words="it follows in ramps: a large step takes longer than a small one",
    equation="|y'| <= rate",
    source="Slotine & Li 1991, 5.2",
    settings=SlewSettings,
    build=build_slew,
    act={"command": "{m}.volts[{c}] = slew.slew({p}, {s}, {m}.volts[{c}])"},
    stands=(stand("drive", "general"),),
    look_alikes={
        "drive.lag": "small and large steps: a lag takes the same time for both, a rate limit only spoils the large",
        "timing.delay": "small and large steps: a delay is the same time for both",
        "drive.saturation": "hold a large command: a limit stays short of it, a rate limit gets there",
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
    draws={"rate": Draw(0.2, 0.6, "pace")},
)
