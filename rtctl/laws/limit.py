"""Output limit with an optional slew rate, in V.

    low <= u <= high        |u - u_prev| <= slew dt

The slew starts from 0 V. A value that is not a number never reaches the output: it is written as 0 V, or the nearest
that the limits allow, and counted.

Source: thesis 12.2 (no more than 3 V to the driver of the linear drive) and 7.1 (10 V range of the board).
"""

from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class LimitSettings(Settings):
    high: float = quantity(10.0, unit="V", safer="smaller", help="highest output")
    low: float | None = quantity(
        None, unit="V", safer="larger", absent="high", help="lowest output; minus the highest if absent"
    )
    slew: float | None = quantity(None, unit="V/s", gt=0, safer="smaller", help="fastest change; unlimited if absent")


class LimitParams(NamedTuple):
    low: float  # V
    high: float  # V
    most: float  # V, largest change in a tick


LIMIT_STATE = state(u=float, saturated=int, n_saturated=int, n_nan=int)  # V, 1 while limiting, ticks limited, ticks NaN


def build(settings: LimitSettings, dt: float) -> LimitParams:
    """Limits for a tick of `dt` s. Raises ValueError where no output is left between them."""
    low = -settings.high if settings.low is None else settings.low
    if low >= settings.high:
        raise ValueError(f"the lowest output {low:g} V is not below the highest {settings.high:g} V")
    return LimitParams(low, settings.high, float("inf") if settings.slew is None else settings.slew * dt)


@tick
def step(p, s, u):
    """The voltage that may be written where `u` V is wanted."""
    wanted = u
    if u != u:
        s.n_nan += 1
        u = 0.0
    u = min(max(u, s.u - p.most), s.u + p.most)
    s.u = min(max(u, p.low), p.high)
    s.saturated = 1 if s.u != wanted else 0
    s.n_saturated += s.saturated
    return s.u


@tick
def reset(p, s, u):
    """Start the slew from `u` V, the voltage in force. The counters stay."""
    s.u = min(max(u, p.low), p.high)
    s.saturated = 0
