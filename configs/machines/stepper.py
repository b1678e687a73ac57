"""Stepping motor without feedback: the command is the angle that the reference asks for.

    u = ratio ref

The drive cuts it into steps (`dac_bits`, `dac_range`); the motor holds its rotor to that angle as a spring does.

Source: thesis chapter 2, "To control the paper translation, an open loop controller is used".
"""

from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class StepperSettings(Settings):
    """What a person writes in the config."""

    ratio: float = quantity(1.0, unit="", help="angle of the motor for one unit of the reference")


class StepperParams(NamedTuple):
    """What a tick needs of it."""

    ratio: float


STEPPER_STATE = state(angle=float)  # rad, asked for


def build(settings: StepperSettings, dt: float) -> StepperParams:
    """Params for a tick of `dt` s."""
    return StepperParams(settings.ratio)


@tick
def step(p, s, ref):
    """Angle in rad to step to."""
    s.angle = p.ratio * ref
    return s.angle


@tick
def reset(p, s):
    """The outputs come on: the motor has no angle yet."""
    s.angle = 0.0
