"""Integral action with a dead zone in the error and anti-windup, beside a law that has none.

    i += k_i dt dead(e)            dead(e) = e beyond +-zone, less zone; 0 within
    i += dt / tau_t (u_written - u_wanted)             back-calculation, once a tick after the limit

Dry friction and an integral cause hunting: the machine sticks, the integral grows, breaks it loose and overshoots.
Within the dead zone the integral stays constant, so that the machine stays at rest at its target.

Source: Astrom & Hagglund, PID Controllers (1995), section 3.5; Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica
30 (1994), 4.2 (hunting, dead zone at the integrator's input).
"""

from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class IntegralSettings(Settings):
    gain: float = quantity(unit="V/rad/s", ge=0, help="k_i, command per unit of error and second")
    dead_zone: float = quantity(0.0, unit="rad", ge=0, help="error within which the integral rests")
    tau_t: float = quantity(0.1, unit="s", gt=0, help="tracking time of the anti-windup")


class IntegralParams(NamedTuple):
    gain: float  # V per unit of error, per tick
    zone: float  # unit of error
    tracking: float  # share of the cut-off voltage that leaves the integral each tick


INTEGRAL_STATE = state(i=float)  # V


def build(settings: IntegralSettings, dt: float) -> IntegralParams:
    """Coefficients for a tick of `dt` s. Raises ValueError where the tracking time is shorter than the tick."""
    if settings.tau_t < dt:
        raise ValueError(f"tau_t {settings.tau_t:g} s is shorter than the tick {dt:g} s; the integral would oscillate")
    tracking = dt / settings.tau_t if settings.gain > 0 else 0.0  # an integral that is off stays at zero
    return IntegralParams(settings.gain * dt, settings.dead_zone, tracking)


@tick
def step(p, s, e):
    """Integral part in V for the position error `e` (rad or m)."""
    if e > p.zone:
        s.i += p.gain * (e - p.zone)
    elif e < -p.zone:
        s.i += p.gain * (e + p.zone)
    return s.i


@tick
def track(p, s, u_wanted, u_written):
    """Back-calculate the integral from input and output of the limiter, both V."""
    s.i += p.tracking * (u_written - u_wanted)


@tick
def reset(p, s):
    """Empty the integral."""
    s.i = 0.0
