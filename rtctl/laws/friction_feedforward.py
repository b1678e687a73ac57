"""Friction feedforward: the voltage that overcomes dry friction in the direction in which the reference moves.

    u = tau_C sign(d ref) / (K_m amp_per_volt)

The sign is that of the last change of the reference and is held while the reference stands still; it is 0 until the
reference has moved once. The law of the exchange format holds nothing: its sign is 0 at rest. Take the lowest friction
measured: compensating too much overshoots (thesis 8.3).

Source: thesis 5.5 and 8.4.
"""

from typing import NamedTuple

from rtctl.idiom import quantity, state, tick
from rtctl.laws.drive import DriveSettings


class FrictionFeedforwardSettings(DriveSettings):
    tau_C: float = quantity(0.0, unit="Nm", ge=0, help="dry friction at the motor; 2.4 mNm was the lowest measured")


class FrictionFeedforwardParams(NamedTuple):
    volts: float  # V that overcome the friction
    held: int = 1  # 0: the direction is forgotten while the reference stands still


FRICTION_FEEDFORWARD_STATE = state(ref=float, direction=float, primed=int)  # reference, -1 0 1, 1 once ref is known


def build(settings: FrictionFeedforwardSettings, dt: float) -> FrictionFeedforwardParams:
    """Nothing to discretise: only changes of the reference count."""
    return FrictionFeedforwardParams(settings.tau_C / settings.torque_per_volt)


@tick
def step(p, s, ref):
    """Voltage in V to add to the command, for the reference `ref` (rad or m)."""
    if s.primed == 0:
        s.ref = ref
        s.primed = 1
    if ref > s.ref:
        s.direction = 1.0
    elif ref < s.ref:
        s.direction = -1.0
    elif p.held == 0:
        s.direction = 0.0
    s.ref = ref
    return p.volts * s.direction


@tick
def reset(p, s):
    """Forget the direction until the reference moves again."""
    s.direction = 0.0
    s.primed = 0
