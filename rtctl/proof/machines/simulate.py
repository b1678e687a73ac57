"""Simulated recordings of a setup, noise floors, visibility of effects, and check of the loop."""

import math

import numpy as np

from rtctl.proof.machines import solver
from rtctl.proof.machines.arrays import NB, ND, NJ, NS
from rtctl.proof.machines.setup import Setup, draws, nothing_played

Run = dict[str, np.ndarray]
SATURATED = 0.3  # share of ticks at the limit above which a case is redrawn
HIDDEN = ("exact", "states", "joints", "forces")  # arrays of a run that its recording does not hold


def simulate(s: Setup, seed: list[int], played: np.ndarray | None = None) -> Run | None:
    """Columns of a recording, and the unmeasured arrays of HIDDEN; None where the loop was unstable."""
    a, n = draws(s, seed), s.n
    y, exact, u = np.zeros((n, NS)), np.zeros((n, NS)), np.zeros((n, ND))
    states, joints, forces = np.zeros((n, 2 * NB)), np.zeros((n, NJ)), np.zeros((n, ND))
    rows = solver.run(
        s.m[()], s.law[()], np.zeros(2 * NB), s.settle, s.ref, s.w, nothing_played() if played is None else played,
        a["push"], a["spot"], a["extra"], a["lost"], y, exact, u, states, joints, forces,
    )  # fmt: skip
    if rows < n:
        return None
    out: Run = {"t": np.arange(n) * s.Ts}
    if not s.open_loop:
        out |= {"ref": s.ref, "w": s.w}
    for d, column in enumerate(s.commands):
        out[column] = u[:, d]
    for k, (column, quantum) in enumerate(s.columns):
        out[column] = y[:, k] * quantum
    return out | {"exact": exact, "states": states, "joints": joints, "forces": forces}


def channels(s: Setup) -> list[str]:
    """Columns of sensors and drives."""
    return [column for column, _ in s.columns] + s.commands


def floors(s: Setup, a: Run, b: Run) -> dict[str, float]:
    """Noise floor per channel: rms difference of runs with two noise seeds, at least the rms of the quantum."""
    quantum = dict(s.columns) | dict.fromkeys(s.commands, max(float(s.law["step"]), 1e-4 * float(s.law["limit"])))
    return {c: max(_rms(a[c] - b[c]) / math.sqrt(2.0), quantum[c] / math.sqrt(12.0)) for c in channels(s)}


def visibility(s: Setup, a: Run, b: Run, floor: dict[str, float]) -> dict[str, dict[str, float]]:
    """Floor, rms change and their ratio for every channel."""
    return {c: {"floor": floor[c], "rms_change": _rms(a[c] - b[c]), "ratio": _rms(a[c] - b[c]) / floor[c]}
            for c in channels(s)}  # fmt: skip


def largest(seen: dict[str, dict[str, float]]) -> float:
    return max(v["ratio"] for v in seen.values())


def healthy(s: Setup, run: Run | None) -> bool:
    """Whether the loop works: finite, follows its reference, not saturated; in open loop, the machine moves."""
    if run is None:
        return False
    for c in s.commands:
        if np.mean(np.abs(run[c]) > 0.99 * float(s.law["limit"])) > SATURATED:
            return False
    i = s.body(s.base)
    if s.open_loop:
        return bool(np.std(run["states"][:, i]) > 0.0)
    speed = s.machine["sensors"][s.control]["measures"] == "speed"
    error = s.ref - run["states"][:, i + (NB if speed else 0)]
    return _rms(error) < 0.5 * float(np.std(s.ref)) and float(np.abs(error).max()) < 1.5 * float(np.ptp(s.ref))


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x * x)))
