"""My plant: a capstan between two motors that pull at it by a tape that does not stretch.

    J w' = K (u1 - u2) - B w        phi' = w

u1 and u2 in V, phi in rad, w in rad/s. Exact for voltages that are held over a substep of h s:

    w+ = a w + (1 - a) K (u1 - u2) / B        a = exp(-B h / J)

The board, its converters, counters and sensors are emulated around this file. `step` gets the voltages u1 and u2 of the
board and leaves in its state the angles `capstan`, `reel1` and `reel2` in rad.
"""

from math import exp
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class MyPlantSettings(Settings):
    """Settings in the config."""

    J: float = quantity(1.8e-3, unit="kg*m^2", gt=0, help="total inertia, referred to the capstan")
    K: float = quantity(5e-3, unit="Nm/V", gt=0, help="torque at the capstan per volt of one motor")
    B: float = quantity(2e-3, unit="Nm*s/rad", gt=0, help="viscous friction at the capstan")
    R_c: float = quantity(12.5e-3, unit="m", gt=0, help="radius of the capstan")
    R1: float = quantity(38e-3, unit="m", gt=0, help="radius of reel 1")
    R2: float = quantity(22e-3, unit="m", gt=0, help="radius of reel 2")


class MyPlantParams(NamedTuple):
    """Params of a substep."""

    h: float  # s
    a: float  # share of the speed that remains after a substep
    gain: float  # rad/s per V, in steady state
    tau: float  # s
    ratio1: float  # turns of a reel per turn of the capstan
    ratio2: float


MY_PLANT_STATE = state(capstan=float, reel1=float, reel2=float, w=float)  # rad, rad, rad, rad/s


def build(settings: MyPlantSettings, h: float) -> MyPlantParams:
    """Params for substeps of `h` s, made of the settings here only."""
    tau = settings.J / settings.B
    ratios = settings.R_c / settings.R1, -settings.R_c / settings.R2
    return MyPlantParams(h, exp(-h / tau), settings.K / settings.B, tau, *ratios)


@tick
def start(p, s):
    """Set the state to rest."""
    s.capstan = 0.0
    s.reel1 = 0.0
    s.reel2 = 0.0
    s.w = 0.0


@tick
def step(p, s, u1, u2):
    """One substep under the voltages `u1` and `u2`."""
    end = p.gain * (u1 - u2)
    s.capstan += end * p.h + (s.w - end) * p.tau * (1.0 - p.a)
    s.w = end + (s.w - end) * p.a
    s.reel1 = p.ratio1 * s.capstan
    s.reel2 = p.ratio2 * s.capstan
