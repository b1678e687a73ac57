"""Predictor: position of the machine at the time at which the present command acts, for a loop with a delay.

    v+ = v + dt K u_n                                  u_n: command that acts now, written n ticks before
    y_n = y + n dt v + sum over the n commands on their way of K dt^2 (n - i + 1/2) u_i

The law closes on y_n instead of y, which removes the delay from the loop as far as K is right. The reference must be
taken n ticks ahead, as a feedforward with `lead` does; otherwise the machine follows n ticks late.

Source: Artstein, Linear systems with delayed controls: a reduction, IEEE TAC 27 (1982); Smith, Chemical Engineering
Progress 53 (1957), for the idea.
"""

from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick

MOST = 64  # ticks


class PredictorSettings(Settings):
    delay: int = quantity(unit="", ge=1, le=MOST, help="ticks until a command acts")
    acceleration: float = quantity(
        unit="rad/s^2/V", ge=0, help="K, acceleration of the feedback for one unit of command"
    )


class PredictorParams(NamedTuple):
    n: int
    K: float  # unit/s^2/V
    dt: float  # s


PREDICTOR_STATE = state(u=(float, MOST), at=int)  # commands on their way, V; where the next one goes


def build(settings: PredictorSettings, dt: float) -> PredictorParams:
    """Params for a tick of `dt` s."""
    return PredictorParams(settings.delay, settings.acceleration, dt)


@tick
def step(p, s, y, v):
    """Position in rad or m after the delay, for the position `y` and speed `v` measured now."""
    x = y + p.n * p.dt * v
    for i in range(p.n):  # the oldest first: it acts longest
        u = s.u[(s.at + i) % p.n]
        x += p.K * p.dt * p.dt * (p.n - i - 0.5) * u
    return x


@tick
def track(p, s, u_written):
    """Put the command that was written on its way, V."""
    s.u[s.at] = u_written
    s.at = (s.at + 1) % p.n


@tick
def reset(p, s):
    """No command is on its way."""
    s.at = 0
    for i in range(MOST):
        s.u[i] = 0.0
