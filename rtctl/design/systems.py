"""The loop of a config as sampled linear systems of python-control: exact between the samples, with every pole.

The plant is discretised with its hold by the matrix exponential, the tick until a command is written is a state, and
the law is the sampled law of the tick. These systems give poles and step responses; `response` gives curves.

Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems (1998), 4.3 (exact discretisation).
"""

from collections.abc import Iterable
from typing import Any

import control
import numpy as np

from rtctl.design import response
from rtctl.design.response import Loop, Model
from rtctl.laws import disturbance_observer, state_feedback
from rtctl.laws.transfer import System
from rtctl.plants import linear


def sampled(config: Any, motor: int = 1) -> tuple[Any, Any, Any]:
    """Plant with its delay, law from the negative position, and law from the reference, all `control.StateSpace`."""
    parts = response.take(config, motor)
    return plant_system(parts.model, parts.dt, parts.delay), law_system(parts), law_system(parts, "reference")


def poles(config: Any, motor: int = 1) -> np.ndarray:
    """Poles of the closed loop in the z plane; stable where all lie inside the unit circle."""
    P, K, _ = sampled(config, motor)
    return np.asarray(control.feedback(P * K, 1).poles())


def closed(config: Any, motor: int = 1) -> Any:
    """System from the shaped reference to the measured position."""
    P, K, R = sampled(config, motor)
    return control.feedback(P, K) * R


def plant_system(model: Model, dt: float, delay: int) -> Any:
    """A model behind a zero-order hold and `delay` ticks, as a sampled system."""
    Phi_T, Gamma_T = linear.discretise(model.A, model.b[:, None], dt)
    system = control.ss(Phi_T.T, Gamma_T.T, model.c[None, :], 0, dt)
    for _ in range(delay):
        system = system * control.ss(0, 1, 1, 0, dt)
    return system


def law_system(parts: Loop, path: str = "feedback") -> Any:
    """The law as a sampled system: `feedback` from the negative position, `reference` from the reference."""
    p, dt = parts.blocks["position"], parts.dt
    if parts.kind == "sections":
        K = _filtered(_system([1.0], [1.0], dt), p, dt)
    elif parts.kind == "pd":
        K = p.gain + p.D * _difference(p.a, dt)
    elif parts.kind == "state_feedback":
        K = _of_law(state_feedback.system(p, path), dt)
    else:
        K = _system([p.gain], [1.0], dt)
        if p.integral:
            K = K + _integral(p.integral, dt)
        if path == "feedback":
            v = parts.blocks["velocity"]
            K = K + p.velocity_gain * _difference(v.a, v.dt)
    return compensated(parts, parts.factor * K, path)


def compensated(parts: Loop, K: Any, path: str) -> Any:
    """A law `K` with the filter, the integral, the predictor and the disturbance observer around it."""
    blocks, dt = parts.blocks, parts.dt
    K = _filtered(K, blocks.get("filter", ()), dt)
    if "integral" in blocks and blocks["integral"].gain:
        K = K + _integral(blocks["integral"].gain, dt)
    if "predictor" in blocks and path == "feedback":
        p, v = blocks["predictor"], blocks["velocity"]
        moved = [p.K * p.dt**2 * (n - 0.5) for n in range(1, p.n + 1)]  # by the commands that have not acted yet
        inner = control.ss(control.tf(moved, [1.0, *np.zeros(p.n)], dt))
        K = (1.0 + p.n * p.dt * _difference(v.a, v.dt)) * control.feedback(K, inner)
    if "observer" in blocks:
        to_y, to_u = (_of_law(s, dt) for s in disturbance_observer.systems(blocks["observer"], parts.motor == 2))
        K = control.feedback(1.0, to_u, sign=1) * (K + to_y if path == "feedback" else K)
    return K


def _filtered(K: Any, sections: Iterable[Any], dt: float) -> Any:
    """A law with second-order sections behind it, by their params."""
    for section in sections:
        K = _system([section.b0, section.b1, section.b2], [1.0, section.a1, section.a2], dt) * K
    return K


def _of_law(system: System, dt: float) -> Any:
    A, b, c, d = system
    return control.ss(A, b[:, None], c[None, :], d, dt)


def _integral(gain: float, dt: float) -> Any:
    return _system([gain, 0.0], [1.0, -1.0], dt)


def _difference(a: float, dt: float) -> Any:
    return _system([a / dt, -a / dt], [1.0, a - 1.0], dt)


def _system(num: list[float], den: list[float], dt: float) -> Any:
    """System num / den in falling powers of z, without the common factor z of coefficients 0 at both ends."""
    while len(den) > 1 and num[-1] == den[-1] == 0.0:
        num, den = num[:-1], den[:-1]
    return control.ss(control.tf(num, den, dt))
