"""Optical sensor on a reel: 209 dark and light marks a turn, one light beam, so without direction.

Plant side: a voltage of 0 to 5 V with flanks as wide as the beam. Loop side: an analog input samples the voltage, and a
comparator with hysteresis counts rising edges. Noise on a flank is not counted, but a reel that turns back counts up.

Source: thesis 6.1, 7.1.1, 7.4; appendix B (figures B.2, B.3).
"""

import math
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick

FULL_VOLTS = 5.0


class OpticalSensorSettings(Settings):
    pulses: int = quantity(209, unit="", gt=0, le=100_000, help="rising edges per revolution")
    phase: float = quantity(0.0, unit="", ge=0, lt=1, help="periods at angle zero; 0 is the middle of a dark stretch")
    flank: float = quantity(0.1, unit="", gt=0, le=0.5, help="part of a period that a flank takes, 0 to 5 V")
    low: float = quantity(2.0, unit="V", gt=0, lt=FULL_VOLTS, help="comparator goes low below this")
    high: float = quantity(3.0, unit="V", gt=0, lt=FULL_VOLTS, help="comparator goes high above this")


class OpticalSensorParams(NamedTuple):
    periods_per_radian: float
    phase: float
    flank: float
    low: float
    high: float
    radians_per_count: float


OPTICAL_SENSOR_STATE = state(primed=int, high=int, counts=int)


def build(settings: OpticalSensorSettings, dt: float) -> OpticalSensorParams:
    """Parameters, independent of `dt`. Raises ValueError where the comparator's low level is not below the high one."""
    if settings.low >= settings.high:
        raise ValueError(
            f"the comparator's low level {settings.low:g} V must lie below its high level {settings.high:g} V"
        )
    turn = 2 * math.pi
    return OpticalSensorParams(settings.pulses / turn, settings.phase, settings.flank, settings.low, settings.high,
                               turn / settings.pulses)  # fmt: skip


def highest_speed(settings: OpticalSensorSettings, dt: float) -> float:
    """Speed in rad/s up to which no edge is missed when the voltage is sampled every `dt` s.

    Every interval above `high` and every interval below `low` must contain a sample. Default: 7.2 rad/s at 2 ms.
    """
    over = 0.5 - settings.flank * (2 * settings.high / FULL_VOLTS - 1)
    under = 0.5 - settings.flank * (1 - 2 * settings.low / FULL_VOLTS)
    return 2 * math.pi / settings.pulses * min(over, under) / dt


@tick
def volts(p, theta):
    """Sensor voltage, 0 to 5 V, at angle `theta` (rad): a trapezium, half of each period above 2.5 V."""
    u = theta * p.periods_per_radian + p.phase
    u -= math.floor(u)
    height = 0.5 + (0.25 - abs(u - 0.5)) / p.flank
    return FULL_VOLTS * min(max(height, 0.0), 1.0)


@tick
def count(p, s, volts):
    """Number of rising edges so far, with a new sample in V. The first call only stores the level."""
    if s.primed == 0:
        s.primed = 1
        s.high = 1 if volts > p.high else 0
    elif s.high == 0 and volts > p.high:
        s.high = 1
        s.counts += 1
    elif volts < p.low:
        s.high = 0
    return s.counts


@tick
def radians(p, counts):
    """Angle turned in rad, without direction, at `counts`."""
    return counts * p.radians_per_count
