"""The LDU's current amplifier: input of a non-negative voltage and a direction bit, output a current.

    I = 0.042 A                      V < 0.8 V         always some current
    I = 0.042 + 0.1 (V - 0.8) A      0.8 <= V <= 3.0 V
    I = 5 A                          V > 3.0 V         runaway: the zener cuts off the current feedback     (12.3)

`linear` is the nominal gain, 0.1 A/V. `compensate` inverts the measured curve, V = |u| + 0.38 V, for a gain of 0.1 A/V
from 0.042 A upwards. Below 0.042 A, 0 V is sent and 0.042 A flows in the direction of u. The error is at most 0.042 A,
which dry friction hides.

The loop side never sends more than `limit`, rounded down to a whole code: the nearest code could be above 3.0 V.

Source: thesis 12.2, (12.3). Erratum: the text gives 0.23 A at 3.0 V, its equation gives 0.262 A.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, tick

AMPERE_PER_VOLT = 0.1
OFFSET_AMPERE = 0.042
KNEE_VOLTS = 0.8
ZENER_VOLTS = 3.0
RUNAWAY_AMPERE = 5.0
OFFSET_VOLTS = OFFSET_AMPERE / AMPERE_PER_VOLT  # V, command u at which the linear part begins


class LduAmplifierSettings(Settings):
    kind: Literal["measured", "linear"] = Field("measured", description="(12.3), or 0.1 A/V")
    compensate: bool = Field(False, description="invert the measured curve on the loop side")
    limit: float = quantity(ZENER_VOLTS, unit="V", gt=0, le=10, help="highest voltage sent; above 3.0 V it runs away")


class LduAmplifierParams(NamedTuple):
    measured: int
    compensate: int
    limit: float  # V, a whole number of codes


def build(settings: LduAmplifierSettings, dt: float, volts_per_code: float = 10.0 / 2048) -> LduAmplifierParams:
    """Parameters for an output of `volts_per_code`. Raises ValueError where the limit allows a runaway."""
    if settings.kind == "measured" and settings.limit > ZENER_VOLTS:
        raise ValueError(f"limit {settings.limit:g} V is above 3.0 V, where the measured amplifier runs away to 5 A")
    limit = math.floor(settings.limit / volts_per_code) * volts_per_code
    compensate = settings.compensate and settings.kind == "measured"  # a linear amplifier needs no compensation
    return LduAmplifierParams(int(settings.kind == "measured"), int(compensate), limit)


@tick
def encode(p, u):
    """Input voltage (V, 0 to limit) for a command of `u` V, nominally 0.1 A/V. NaN gives 0 V."""
    volts = abs(u)
    if math.isnan(volts):
        return 0.0
    if p.compensate != 0:
        volts = volts + KNEE_VOLTS - OFFSET_VOLTS if volts >= OFFSET_VOLTS else 0.0
    return min(volts, p.limit)


@tick
def direction(p, u):
    """Direction bit: 1 for a positive current, 0 for a negative one."""
    return 0 if u < 0.0 else 1


@tick
def current(p, volts, direction):
    """Current in A, signed by `direction` (1 or 0), at an input of `volts`; below 0 V the input diode holds 0 V."""
    v = max(volts, 0.0)
    if p.measured == 0:
        ampere = AMPERE_PER_VOLT * v
    elif v > ZENER_VOLTS:
        ampere = RUNAWAY_AMPERE
    else:
        ampere = OFFSET_AMPERE + AMPERE_PER_VOLT * max(v - KNEE_VOLTS, 0.0)
    return ampere if direction != 0 else -ampere


@tick
def drive(p, volts, forward):
    """Current in A for a signed voltage; at 0 V the direction bit `forward` gives the sign of the offset."""
    if volts > 0.0:
        return current(p, volts, 1)
    if volts < 0.0:
        return current(p, -volts, 0)
    return current(p, 0.0, forward)
