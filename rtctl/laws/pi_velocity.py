"""The present law of the linear drive: PI on position around an inner velocity feedback.

    i += gain dt / tau_i e                 integral part, V
    u  = gain e + i - velocity_gain v

While the output is limited the integral follows what was really written instead of winding up
(back-calculation): call `track` after the limiter, once a tick.

    i += dt / tau_t (u_written - u_wanted)

Source: thesis 12.7, figure 12.7; Astrom & Hagglund, PID Controllers (1995), section 3.5, for the tracking.
"""

from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws.integral import reset, track

__all__ = ["PI_VELOCITY_STATE", "PiVelocityParams", "PiVelocitySettings", "build", "reset", "step", "track"]


class PiVelocitySettings(Settings):
    gain: float = quantity(unit="V/m", ge=0, help="proportional gain, V per unit of error")
    tau_i: float | None = quantity(None, unit="s", gt=0, help="integral time; no integral action if absent")
    velocity_gain: float = quantity(0.0, unit="V*s/m", ge=0, help="velocity feedback, V per unit of velocity")
    tau_t: float | None = quantity(None, unit="s", gt=0, help="tracking time of the anti-windup; tau_i if absent")


class PiVelocityParams(NamedTuple):
    gain: float  # V per unit of error
    integral: float  # V per unit of error, per tick
    velocity_gain: float  # V per unit of velocity
    tracking: float  # share of the cut-off voltage that leaves the integral each tick


PI_VELOCITY_STATE = state(i=float)  # integral part, V


def build(settings: PiVelocitySettings, dt: float) -> PiVelocityParams:
    """Coefficients for a tick of `dt` s. Raises ValueError where a time constant is shorter than the tick."""
    if settings.tau_i is None:
        return PiVelocityParams(settings.gain, 0.0, settings.velocity_gain, 0.0)
    tau_t = settings.tau_t or settings.tau_i
    for name, tau in (("tau_i", settings.tau_i), ("tau_t", tau_t)):
        if tau < dt:
            raise ValueError(f"{name} {tau:g} s is shorter than the tick {dt:g} s; the integral would oscillate")
    return PiVelocityParams(settings.gain, settings.gain * dt / settings.tau_i, settings.velocity_gain, dt / tau_t)


@tick
def step(p, s, e, v):
    """Command in V for the position error `e` (m or rad) and the measured velocity `v` (per s)."""
    s.i += p.integral * e
    return p.gain * e + s.i - p.velocity_gain * v
