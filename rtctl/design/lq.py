"""LQ state feedback with integral and Kalman filter for a described machine, the fastest that keeps its margins.

    minimise sum y^2 + (w_i int y)^2 + rho u^2          rho = |P(w_c)|^2, so that the loop crosses near w_c
    observer: force noise at the drive, noise of the sensor, so that it follows up to w_e

The filter models every spring between drive and sensor, so the crossover may lie where a PD has no phase margin. LQ
guarantees margins for a measured state and none with an observer: the margins are checked on the sampled loop.

Source: Franklin, Powell & Workman, Digital Control of Dynamic Systems (1998), 9.3 and 9.5; Doyle, Guaranteed margins
for LQG regulators, IEEE Trans. Automatic Control 23 (1978).
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path
from rtctl.design import response
from rtctl.design.fastest import ROOM, fastest, machine_of
from rtctl.design.margins import Margins
from rtctl.laws import state_feedback
from rtctl.machines.described_parts import parts_of
from rtctl.plants import linear

CROSSOVERS = 40  # tried, evenly in the logarithm
SLOWEST, FASTEST = 1 / 2000, 1 / 12  # of the sample rate
FOLLOWS = (3.0, 5.0, 8.0, 15.0)  # w_e / w_c, in the order in which they are tried
INTEGRALS = (6.0, 15.0, 40.0)  # w_c / w_i, likewise
ROUNDED = 10  # digits of the numbers in a config
UNSEEN = 1e-9  # of the largest singular value, below which a direction of the state is unobservable


class Sampled(NamedTuple):
    """Sampled machine, reduced to its controllable and observable states, the delay of the output last."""

    A: np.ndarray  # (n, n)
    B: np.ndarray  # (n,)
    C: np.ndarray  # (n,)
    noise: np.ndarray  # (n,) where a force at the drive enters


class Designed(NamedTuple):
    """A config with a state feedback that holds, with its crossover and margins."""

    config: Any
    crossover: float  # Hz
    margins: Margins
    words: str


def design(config: Any, least: tuple[float, float], bandwidth: float | None = None) -> Designed:
    """The law with the highest crossover that keeps `least` dB and degrees; about `bandwidth` Hz where it is given.

    Raises NoAnswer where none is stable with these margins, or where the machine has more states than the law.
    """
    parts, rate = parts_of(config), config.loop.rate
    start = response.take(set_path(config, "law.position", {"kind": "pd", "gain": 1.0}))
    model, machine = sampled(start), machine_of(config, start)
    if len(model.B) > state_feedback.MOST:
        raise NoAnswer(
            f"the machine has {len(model.B)} states and a state feedback takes {state_feedback.MOST}; leave "
            "out joints that are stiff (no `stiffness`), or tune a PD"
        )

    def tried() -> Iterator[tuple[float, dict[str, Any], response.Loop]]:
        wanted = np.geomspace(FASTEST * rate, SLOWEST * rate, CROSSOVERS) if bandwidth is None else [bandwidth]
        for crossover in wanted:
            for law in laws(model, machine.f, np.abs(machine.P), float(crossover), start.dt):
                params = state_feedback.build(state_feedback.StateFeedbackSettings(**law), start.dt)
                blocks = {**start.blocks, "position": params}
                yield float(crossover), law, start._replace(kind="state_feedback", blocks=blocks)

    found = fastest(config, machine, tried(), least, ROOM if bandwidth is None else (0.0, 0.0))
    if isinstance(found, str):
        raise NoAnswer(
            f"no state feedback from {parts.feedback} to {parts.drive} is stable with {least[0]:g} dB and {least[1]:g} "
            f"degrees{found}; lower --gm or --pm, or take a faster loop.rate"
        )
    made = set_path(config, "law.position", {"kind": "state_feedback", **found.law})
    words = f"LQ with an observer of {len(model.B)} states from {parts.feedback} to {parts.drive}"
    return Designed(made, found.crossover, found.margins, words)


def sampled(start: response.Loop) -> Sampled:
    """Sampled machine of a loop behind its hold and its delay, without unobservable and uncontrollable states."""
    Phi_T, Gamma_T = linear.discretise(start.model.A, start.model.b[:, None], start.dt)
    A, B, C = Phi_T.T, Gamma_T.T[:, 0], start.model.c
    for _ in range(2):  # unobservable states, then, by the transposed system, uncontrollable states
        rows = [C / np.linalg.norm(C)]
        for _ in range(len(A) - 1):
            row = rows[-1] @ A
            rows.append(row / max(float(np.linalg.norm(row)), 1e-300))
        _, sizes, directions = np.linalg.svd(np.array(rows))
        kept = directions[sizes > UNSEEN * sizes[0]]
        A, B, C = (kept @ A @ kept.T).T, kept @ C, kept @ B
    n = len(A)
    none = np.zeros(start.delay)  # of none or one tick
    whole, by = np.zeros((n + start.delay, n + start.delay)), np.zeros(n + start.delay)
    whole[:n, :n] = A
    if start.delay:
        whole[:n, n], by[n] = B, 1.0
    else:
        by[:n] = B
    return Sampled(whole, by, np.append(C, none), np.append(B, none))


def laws(machine: Sampled, f: np.ndarray, P: np.ndarray, crossover: float, dt: float) -> Iterator[dict[str, Any]]:
    """Settings of the state feedbacks that cross near `crossover` Hz, by bandwidth of the observer and rate of the
    integral. `P` (n,) is the size of the machine's response at `f` (n,) Hz. No settings where a Riccati equation has
    no solution."""
    from scipy.linalg import solve_discrete_are  # slow to import, and needed here only

    A, B, C, noise = machine
    n, w = len(B), 2 * np.pi * crossover

    def at(hertz: float) -> float:
        return float(np.exp(np.interp(np.log(hertz), np.log(f), np.log(P))))

    whole = np.zeros((n + 1, n + 1))  # with the integral of the position
    whole[:n, :n], whole[n, :n], whole[n, n] = A, dt * C, 1.0
    Q = np.zeros_like(whole)
    Q[:n, :n] = np.outer(C, C)
    by, rho = np.append(B, 0.0)[:, None], np.array([[at(crossover) ** 2]])
    rest = np.block([[A - np.eye(n), B[:, None]], [C[None, :], np.zeros((1, 1))]])
    *stand, hold = _short(np.linalg.lstsq(rest, np.append(np.zeros(n), 1.0), rcond=None)[0])
    model = {"A": [_short(row) for row in A], "B": _short(B), "C": _short(C), "N": stand, "N_u": hold}
    try:
        observers = []
        for factor in FOLLOWS:
            loud = 1.0 / at(min(factor * crossover, f[-1])) ** 2  # variance of force noise over that of the sensor
            Y = solve_discrete_are(A.T, C[:, None], loud * np.outer(noise, noise), np.array([[1.0]]))
            observers.append(_short(Y @ C / (1.0 + C @ Y @ C)))
        for slower in INTEGRALS:
            Q[n, n] = (w / slower) ** 2
            X = solve_discrete_are(whole, by, Q, rho)
            *K, integral = _short(np.linalg.solve(rho + by.T @ X @ by, by.T @ X @ whole)[0])
            tail = {"integral": max(integral, 0.0), "tau_t": max(_short([slower / w])[0], dt)}
            for L in observers:
                yield {**model, "L": L, "K": K, **tail}
    except np.linalg.LinAlgError:
        return


def _short(values: Any) -> list[float]:
    return [float(f"{value:.{ROUNDED}g}") for value in values]
