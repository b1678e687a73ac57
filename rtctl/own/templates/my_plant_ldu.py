"""My plant: a carriage, driven by a capstan, with viscous friction.

    M v' = K u - F_v v        x' = v

u in V, x in m, v in m/s. The encoder turns with the capstan, x / R_c rad.
Exact for a voltage that is held over a substep of h s:

    v+ = a v + (1 - a) K u / F_v        a = exp(-F_v h / M)

The board, its converters, counters and sensors are emulated around this file. `step` gets the voltage u of the board
and leaves in its state `encoder` in rad and `scale` in m, for the sensors to count.
"""

from math import exp
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class MyPlantSettings(Settings):
    """Settings in the config."""

    M: float = quantity(47.0, unit="kg", gt=0, help="moving mass, referred to the carriage")
    K: float = quantity(14.0, unit="N/V", gt=0, help="force per volt")
    F_v: float = quantity(5.0, unit="N*s/m", gt=0, help="viscous friction")
    R_c: float = quantity(3e-3, unit="m", gt=0, help="radius of the capstan")


class MyPlantParams(NamedTuple):
    """Params of a substep."""

    h: float  # s
    a: float  # share of the speed that remains after a substep
    gain: float  # m/s per V, in steady state
    tau: float  # s
    R_c: float  # m


MY_PLANT_STATE = state(encoder=float, scale=float, v=float)  # rad, m, m/s; `v` is recorded as truth


def build(settings: MyPlantSettings, h: float) -> MyPlantParams:
    """Params for substeps of `h` s, made of the settings here only."""
    tau = settings.M / settings.F_v
    return MyPlantParams(h, exp(-h / tau), settings.K / settings.F_v, tau, settings.R_c)


@tick
def start(p, s):
    """Set the state to rest."""
    s.encoder = 0.0
    s.scale = 0.0
    s.v = 0.0


@tick
def step(p, s, u):
    """One substep under the voltage `u`."""
    end = p.gain * u
    s.scale += end * p.h + (s.v - end) * p.tau * (1.0 - p.a)
    s.v = end + (s.v - end) * p.a
    s.encoder = s.scale / p.R_c
