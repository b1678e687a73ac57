"""Stepping motor without feedback: the command is the reference angle.

    u = ratio ref

The drive rounds the command to steps (`dac_bits`, `dac_range`). The motor pulls its rotor to this angle like a spring.

Source: thesis chapter 2, "To control the paper translation, an open loop controller is used".
"""

from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class StepperSettings(Settings):
    """Settings in the config."""

    ratio: float = quantity(1.0, unit="", help="angle of the motor for one unit of the reference")


class StepperParams(NamedTuple):
    """Parameters of a tick."""

    ratio: float


STEPPER_STATE = state(angle=float)  # rad, commanded


def build(settings: StepperSettings, dt: float) -> StepperParams:
    """Parameters for a tick of `dt` s."""
    return StepperParams(settings.ratio)


@tick
def step(p, s, ref):
    """Commanded motor angle, rad."""
    s.angle = p.ratio * ref
    return s.angle


@tick
def reset(p, s):
    """Initial state at switch-on of the outputs: commanded angle 0."""
    s.angle = 0.0
