"""State feedback from an observer, with an integral, for a design by LQ or by pole placement.

    x^ += L (y - C x^)                                  correction by the sample
    i  += K_i dead(e)                                   against a constant force
    u   = K (N ref - x^) + N_u ref + i                  N, N_u: state and command at rest at ref = 1
    x^  = A x^ + B u_written                            once a tick after the limit; i is back-calculated there

A, B and C are the sampled model with the tick until a command is written, so that the observer uses the command that
acts and not the command before the limit. `rtctl tune CONFIG --method lq` writes these settings for the machine that
a config describes.

Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems (1998), ch. 8 (current estimator, integral
control, reference input); Astrom & Wittenmark, Computer-Controlled Systems (1997), 9.4 for the limit in the observer.
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws import integral, transfer
from rtctl.laws.integral import IntegralParams, IntegralSettings
from rtctl.laws.integral import track as unwind
from rtctl.laws.transfer import System

MOST = 16  # states


class StateFeedbackSettings(Settings):
    A: list[list[float]] = Field(description="sampled model, rows of n numbers: state of the next tick by the state")
    B: list[float] = Field(description="the same by the command that is written, n numbers")
    C: list[float] = Field(description="what the feedback shows of the state, n numbers")
    L: list[float] = Field(description="gain of the observer by the innovation, n numbers")
    K: list[float] = Field(description="command by the state, n numbers")
    N: list[float] = Field(description="state at rest where the feedback is 1, n numbers")
    N_u: float = quantity(0.0, unit="V/rad", help="command that holds it there")
    integral: float = quantity(0.0, unit="V/rad/s", ge=0, help="K_i, command per unit of error and second")
    tau_t: float = quantity(0.1, unit="s", gt=0, help="tracking time of the integral's anti-windup")


class StateFeedbackParams(NamedTuple):
    n: int
    A: np.ndarray  # (MOST, MOST)
    B: np.ndarray  # (MOST,)
    C: np.ndarray  # (MOST,)
    L: np.ndarray  # (MOST,)
    K: np.ndarray  # (MOST,)
    N: np.ndarray  # (MOST,)
    N_u: float  # V per unit of position
    integral: float  # V per unit of error, per tick
    tracking: float  # share of the cut-off command that leaves the integral each tick


STATE_FEEDBACK_STATE = state(x=(float, MOST), was=(float, MOST), i=float, primed=int)  # estimate; integral, V


def build(settings: StateFeedbackSettings, dt: float) -> StateFeedbackParams:
    """Arrays for a tick of `dt` s, which has to be that of the design.

    Raises ValueError where the numbers do not fit together or the integral would oscillate.
    """
    n = len(settings.B)
    if not 0 < n <= MOST:
        raise ValueError(f"B has {n} numbers; a model has 1 to {MOST} states")
    for name in ("C", "L", "K", "N"):
        if len(getattr(settings, name)) != n:
            raise ValueError(f"{name} has {len(getattr(settings, name))} numbers, B has {n}; each has one for a state")
    if [len(row) for row in settings.A] != [n] * n:
        raise ValueError(f"A is {n} rows of {n} numbers, as B has {n}")
    A = np.zeros((MOST, MOST))
    A[:n, :n] = settings.A
    B, C, L, K, N = (_padded(row) for row in (settings.B, settings.C, settings.L, settings.K, settings.N))
    part = IntegralParams(0.0, 0.0, 0.0)
    if settings.integral > 0.0:
        part = integral.build(IntegralSettings(gain=settings.integral, tau_t=settings.tau_t), dt)
    return StateFeedbackParams(n, A, B, C, L, K, N, settings.N_u, part.gain, part.tracking)


def _padded(row: list[float]) -> np.ndarray:
    out = np.zeros(MOST)
    out[: len(row)] = row
    return out


@tick
def step(p, s, e, x, ref):
    """Command in V for the position error `e`, the measured position `x` and its reference `ref` (rad or m)."""
    if s.primed == 0:  # begin at rest at the measured position
        for j in range(p.n):
            s.x[j] = p.N[j] * x
        s.primed = 1
    r = x
    for j in range(p.n):
        r -= p.C[j] * s.x[j]
    s.i += p.integral * e
    u = p.N_u * ref + s.i
    for j in range(p.n):
        s.x[j] += p.L[j] * r
        u += p.K[j] * (p.N[j] * ref - s.x[j])
    return u


@tick
def track(p, s, u_wanted, u_written):
    """Predict the next sample from the command written, V, and take from the integral what was cut off."""
    unwind(p, s, u_wanted, u_written)
    for j in range(p.n):
        s.was[j] = s.x[j]
    for j in range(p.n):
        s.x[j] = p.B[j] * u_written
        for k in range(p.n):
            s.x[j] += p.A[j, k] * s.was[k]


@tick
def reset(p, s):
    """Forget the estimate: the next step begins at rest at the measured position."""
    s.i = 0.0
    s.primed = 0


def system(p: StateFeedbackParams, path: str = "feedback") -> System:
    """A (n+1, n+1), b (n+1,), c (n+1,) and d of the law from the negative position (`feedback`) or from the reference
    alone (`reference`) to the command."""
    n = p.n
    A, B, C, L, K, N = p.A[:n, :n], p.B[:n], p.C[:n], p.L[:n], p.K[:n], p.N[:n]
    seen = np.eye(n) - np.outer(L, C)
    if path == "feedback":
        estimate, direct = -L, float(K @ L) + p.integral
    else:
        estimate, direct = np.zeros(n), float(K @ N) + p.N_u + p.integral
    c = np.append(-K @ seen, 1.0)
    whole = np.zeros((n + 1, n + 1))
    whole[:n] = np.column_stack([A @ seen, np.zeros(n)]) + np.outer(B, c)
    whole[n, n] = 1.0
    b = np.append(A @ estimate + B * direct, p.integral)
    return whole, b, c, direct


def response(p: StateFeedbackParams, back: np.ndarray, path: str = "feedback") -> np.ndarray:
    """Response (n,) of the law, `back` = e^(-j w dt)."""
    return transfer.response(system(p, path), 1.0 / np.asarray(back))
