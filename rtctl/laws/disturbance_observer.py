"""Disturbance observer: estimate of the external force in units of the command, subtracted from the command.

    r  = y - x^                                        innovation
    x^ += (1 - z^3) r,   v^ += 3/2 (1 - z)^2 (1 + z) r / dt,   d^ += (1 - z)^3 r / dt^2          z = exp(-w dt)
    a  = K u - K u_known + K u_beside - B v^ + d^
    x^ += dt v^ + dt^2 a / 2,   v^ += dt a                                                      to the next tick
    u  -= share d^ / K

y is the measured position, K the acceleration for one unit of command, B the viscous friction over the inertia. The
command that has acted since the last sample is the one written `delay` ticks before. `u_known` is the part of it with
which a feedforward compensates known forces; no force is compensated twice. `u_beside` is the positive command that
would accelerate the machine as the voltages outside the command do, such as an inertia feedforward to both motors of a
tape.

Source: Ohnishi, Shibata & Murakami, Motion control for advanced mechatronics, IEEE/ASME Trans. Mechatronics 1 (1996);
gains of a critically damped filter by Brookner, Tracking and Kalman Filtering Made Easy (1998), 1.3 and 2.4.
"""

from math import exp, pi
from typing import NamedTuple

import numpy as np

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws import transfer
from rtctl.laws.transfer import System

MOST_DELAY = 8  # ticks


class DisturbanceObserverSettings(Settings):
    bandwidth: float = quantity(unit="Hz", gt=0, help="of the estimate, w / 2 pi")
    acceleration: float = quantity(
        unit="rad/s^2/V", gt=0, help="K, acceleration of the feedback for one unit of command"
    )
    acceleration_back: float | None = quantity(
        None, unit="rad/s^2/V", gt=0, help="K of negative commands, where another drive pulls; the same if absent"
    )
    damping: float = quantity(0.0, unit="1/s", ge=0, help="B, viscous friction over inertia")
    share: float = quantity(
        1.0, unit="", ge=0, le=1, help="part of the estimate that is compensated; 0 switches it off"
    )
    delay: int = quantity(1, unit="", ge=0, le=MOST_DELAY, help="ticks until a command acts")


class DisturbanceObserverParams(NamedTuple):
    x: float  # gains of the innovation
    v: float  # 1/s
    d: float  # 1/s^2
    K: float  # unit/s^2/V
    K_back: float  # of negative commands
    B: float  # 1/s
    share: float
    delay: int
    dt: float  # s


DISTURBANCE_OBSERVER_STATE = state(
    x=float, v=float, d=float, a=(float, MOST_DELAY + 1), primed=int
)  # estimates; accelerations by the commands of the last ticks, newest first


def build(settings: DisturbanceObserverSettings, dt: float) -> DisturbanceObserverParams:
    """Gains for a tick of `dt` s."""
    z = exp(-2 * pi * settings.bandwidth * dt)
    return DisturbanceObserverParams(
        1 - z**3, 1.5 * (1 - z) ** 2 * (1 + z) / dt, (1 - z) ** 3 / dt**2, settings.acceleration,
        settings.acceleration_back or settings.acceleration, settings.damping, settings.share, settings.delay, dt,
    )  # fmt: skip


@tick
def step(p, s, y):
    """Voltage in V against the estimated disturbance, for the measured position `y` (rad or m)."""
    if s.primed == 0:
        s.x = y
        s.primed = 1
    r = y - s.x
    s.x += p.x * r
    s.v += p.v * r
    s.d += p.d * r
    return -p.share * s.d / (p.K_back if s.d > 0.0 else p.K)


@tick
def pull(p, u):
    """Acceleration by the command `u` in V, whose sign selects the drive."""
    return (p.K if u > 0.0 else p.K_back) * u


@tick
def track(p, s, u_written, u_known, u_beside):
    """Predict the next sample from the command written, its part against known forces, and `u_beside`, all in V.

    The command and its part are accelerations of their own drives: the difference of both may have another sign.
    """
    for i in range(p.delay, 0, -1):
        s.a[i] = s.a[i - 1]
    s.a[0] = pull(p, u_written) - pull(p, u_known) + p.K * u_beside
    a = s.a[p.delay] - p.B * s.v + s.d
    s.x += p.dt * (s.v + 0.5 * p.dt * a)
    s.v += p.dt * a


@tick
def reset(p, s):
    """Set the estimates to zero."""
    s.v = 0.0
    s.d = 0.0
    s.primed = 0
    for i in range(len(s.a)):
        s.a[i] = 0.0


def systems(p: DisturbanceObserverParams, back: bool = False) -> tuple[System, System]:
    """From the negative position, and from the command written, to the voltage against the disturbance, for positive
    commands or with `back` for negative ones."""
    K = p.K_back if back else p.K
    move = np.array([[1, p.dt, p.dt**2 / 2], [0, 1 - p.B * p.dt, p.dt], [0, 0, 1.0]])
    move[0, 1] -= p.B * p.dt**2 / 2
    push = K * np.array([p.dt**2 / 2, p.dt, 0.0])
    gain = np.array([p.x, p.v, p.d])
    seen = np.eye(3) - np.outer(gain, [1.0, 0, 0])
    out = -p.share / K * np.array([0, 0, 1.0])
    A = move @ seen  # of the prediction x(k+1|k)
    to_y: System = A, -move @ gain, out @ seen, float(-out @ gain)
    n = 3 + p.delay  # the commands that have not acted yet come after the estimates, the oldest first
    late, enter = np.zeros((n, n)), np.zeros(n)
    late[:3, :3] = A
    if p.delay:
        late[:3, 3] = push
        late[range(3, n - 1), range(4, n)] = 1.0
        enter[-1] = 1.0
    else:
        enter[:3] = push
    return to_y, (late, enter, np.append(out @ seen, np.zeros(p.delay)), 0.0)


def response(p: DisturbanceObserverParams, f: np.ndarray, back: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Responses (n,) of the voltage against the disturbance to the negative position and to the command written, at
    `f` (n,) Hz, for positive commands or with `back` for negative ones."""
    z = np.exp(2j * np.pi * np.atleast_1d(np.asarray(f, float)) * p.dt)
    to_y, to_u = systems(p, back)
    return transfer.response(to_y, z), transfer.response(to_u, z)
