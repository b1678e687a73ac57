"""PD controller for a coarse encoder: a model estimates position and speed, and each encoder edge corrects the model.

    v' = a_ref + K_p u,  x' = v              feedforward makes the machine follow a_ref; u is the feedback
    x limited to the shown count [n q, (n + 1) q]; if the limit moves x by c,  v += share c / T
    u = gain ((ref - x) + tau_d (v_ref - v))

A position counted in steps of q jumps by q at an edge, and the derivative has a spike there. The edge itself is exact:
in the tick of an edge the position is n q to within the motion of one tick. T is the time since the previous edge.
With friction compensated in the direction of the reference the machine stops but does not reverse. So v keeps its sign.

Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems (1998), 8.2 (estimators); thesis (5.4) for the
PD. Lygouras, Lalakos & Tsalides, IEEE Trans. Instrum. Meas. 47 (1998), for the exactness of edges.
"""

from typing import NamedTuple

from rtctl.idiom import quantity, state, tick
from rtctl.laws import pd


class CoarsePdSettings(pd.PdSettings):
    """Settings in the config: PD settings, encoder step and model."""

    count: float = quantity(unit="rad", gt=0, help="angle between two edges of the encoder")
    K_p: float = quantity(5.1, unit="rad/(V*s^2)", gt=0, help="process gain, with the driver")
    share: float = quantity(0.5, unit="", ge=0, le=1, help="of the speed that an edge asks for")


class CoarsePdParams(NamedTuple):
    """Parameters of a tick."""

    gain: float  # V/rad
    D: float  # V s/rad
    q: float  # rad, one count
    K_p: float  # rad/s^2/V
    share: float
    dt: float  # s


COARSE_PD_STATE = state(x=float, v=float, u=float, shown=float, since=float, direction=float)


def build(settings: CoarsePdSettings, dt: float) -> CoarsePdParams:
    """Parameters for a tick of `dt` s."""
    D = settings.gain * settings.tau_d
    return CoarsePdParams(settings.gain, D, settings.count, settings.K_p, settings.share, dt)


@tick
def step(p, s, x, ref, v_ref, a_ref):
    """Command in V for the encoder position `x` and the reference `ref`, rad, with its speed and acceleration."""
    if v_ref != 0.0:
        s.direction = 1.0 if v_ref > 0.0 else -1.0
    s.v += p.dt * (a_ref + p.K_p * s.u)
    if s.direction * s.v < 0.0:
        s.v = 0.0
    s.x += p.dt * s.v
    held = min(max(s.x, x), x + p.q)
    s.since += p.dt
    if held != s.x:
        s.v += p.share * (held - s.x) / max(s.since, p.dt)
        s.x = held
    if x != s.shown:
        s.shown, s.since = x, 0.0
    s.u = p.gain * (ref - s.x) + p.D * (v_ref - s.v)
    return s.u


@tick
def reset(p, s, x):
    """Initial state at switch-on of the outputs, at encoder position `x`."""
    s.x = x
    s.v = 0.0
    s.u = 0.0
    s.shown = x
    s.since = 0.0
    s.direction = 0.0
