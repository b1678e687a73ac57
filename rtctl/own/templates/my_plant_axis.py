"""My plant: a mass on a guide, pushed by a drive, with viscous friction.

    M v' = K u - F_v v        x' = v

u in V, x in m, v in m/s. Exact for a voltage that is held over a substep of h s:

    v+ = a v + (1 - a) K u / F_v        a = exp(-F_v h / M)

The board, its converters, counters and sensors are emulated around this file. `step` gets the voltage u of the board
and leaves x in its state, for the encoder to count.
"""

from math import exp
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class MyPlantSettings(Settings):
    """Settings in the config."""

    M: float = quantity(95.0, unit="kg", gt=0, help="moving mass")
    K: float = quantity(35.0, unit="N/V", gt=0, help="force per volt")
    F_v: float = quantity(200.0, unit="N*s/m", gt=0, help="viscous friction")


class MyPlantParams(NamedTuple):
    """Params of a substep."""

    h: float  # s
    a: float  # share of the speed that remains after a substep
    gain: float  # m/s per V, in steady state
    tau: float  # s


MY_PLANT_STATE = state(x=float, v=float)  # m, m/s; `x` is what the encoder counts, `v` is recorded as truth


def build(settings: MyPlantSettings, h: float) -> MyPlantParams:
    """Params for substeps of `h` s, made of the settings here only."""
    tau = settings.M / settings.F_v
    return MyPlantParams(h, exp(-h / tau), settings.K / settings.F_v, tau)


@tick
def start(p, s):
    """Set the state to rest."""
    s.x = 0.0
    s.v = 0.0


@tick
def step(p, s, u):
    """One substep under the voltage `u`."""
    end = p.gain * u
    s.x += end * p.h + (s.v - end) * p.tau * (1.0 - p.a)
    s.v = end + (s.v - end) * p.a
