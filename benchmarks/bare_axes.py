"""Diagnosis of axes with friction whose description has only a mass, as in data sets of positioning systems.

    python benchmarks/bare_axes.py [--count 8] [--seed 100] [--jobs 2] [--out FOLDER] [--json]

`rtctl prove` conceals effects in machines with described friction. Here the description has no friction: 20 s at 1 kHz
under a cascaded law, moves at a tenth to all of the top speed, a mass off by up to 10 %, an encoder of 1 in 500 000.
Every axis has dry friction on bristles and viscous friction, and in addition stick-slip, visible presliding, asymmetric
friction, or a constant force. The equations share no code with plants/ or rtctl/diagnose/. Case k of a seed is
reproducible.

Source: Canudas de Wit, Olsson, Astrom & Lischinsky, A new model for control of systems with friction, IEEE TAC 40
(1995); Janot, Gautier & Brunot, Data set and reference models of EMPS (2019) for the kind.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from concealed import run, write
from numba import njit

DT, FINE, SECONDS = 1e-3, 40, 20.0  # s, integration steps per sample, s
LIMIT = 10.0  # V
BRISTLES = "friction.presliding"  # microns in every case: its name is right whether reported or not
PLAIN = ("friction.coulomb", "friction.viscous")
KINDS: tuple[tuple[tuple[str, ...], dict[str, float]], ...] = (
    ((), {}),
    (("friction.stribeck",), {"sticks": 1.6}),
    (("friction.stribeck",), {"sticks": 2.2, "falls": 0.3}),
    ((BRISTLES,), {"gives": 1e-3}),
    ((BRISTLES,), {"gives": 4e-3}),
    (("friction.asymmetry",), {"tilt": 0.25}),
    (("drive.offset",), {"push": 0.4}),
    (("friction.stribeck", "friction.asymmetry"), {"sticks": 1.7, "tilt": 0.2}),
)


class Carriage(NamedTuple):
    """Mass and friction of an axis."""

    M: float
    F_v: float
    F_c: float
    F_s: float
    v_s: float
    sigma: float  # N/m, of the bristles
    damp: float  # Ns/m, of the bristles
    tilt: float
    push: float  # N


class Loop(NamedTuple):
    """Drive, law and encoder of an axis."""

    kp: float
    kv: float
    gain: float  # N/V
    step: float  # m, encoder step


@njit
def moved(c: Carriage, loop: Loop, ref: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Readings in m and voltages in V, (n,) each, with `noise` (n,) in encoder steps.

    Semi-implicit Euler for the motion; exact solution of the bristles over each step.
    """
    x = v = z = x_last = mean_last = 0.0
    shown, volts, h = np.empty(len(ref)), np.empty(len(ref)), DT / FINE
    for k in range(len(ref)):
        y = np.round((x + loop.step * noise[k]) / loop.step) * loop.step
        if k == 0:
            x_last = mean_last = y
        mean = 0.5 * (y + x_last)
        u = loop.kp * loop.kv * (ref[k] - y) - loop.kv * (mean - mean_last) / DT
        u = min(max(u, -LIMIT), LIMIT)
        x_last, mean_last = y, mean
        shown[k], volts[k] = y, u
        for _ in range(FINE):
            side = 1.0 if v > 0.0 else -1.0
            g = (c.F_c + (c.F_s - c.F_c) * np.exp(-((v / c.v_s) ** 2))) * (1.0 + c.tilt * side)
            bent = side * g / c.sigma + (z - side * g / c.sigma) * np.exp(-c.sigma * abs(v) * h / g)
            rub = c.sigma * z + c.damp * (bent - z) / h + c.F_v * v
            v += h * (loop.gain * u + c.push - rub) / c.M
            z = bent
            x += h * v
    return shown, volts


def moves(rng: np.random.Generator, span: float, speeds: np.ndarray) -> np.ndarray:
    """Reference (n,) in m: moves at one of the speeds each, with rests between."""
    ref, at, i = np.zeros(int(SECONDS / DT)), 0.0, 0
    while i < len(ref):
        target, speed = rng.uniform(-span, span), rng.choice(speeds)
        n, rest = int(abs(target - at) / speed / DT) + 1, int(rng.uniform(0.1, 0.4) / DT)
        part = at + (target - at) * (0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(n + rest) / n, 1.0)))
        end = min(len(ref), i + len(part))
        ref[i:end], at, i = part[: end - i], target, end
    return ref


def conceal(folder: Path, seed: int, k: int) -> tuple[str, ...]:
    """Write case k as a bundle; returns its effects beside plain friction."""
    rng, (what, size) = np.random.default_rng(seed + k), KINDS[k % len(KINDS)]
    M, span = 10 ** rng.uniform(0, 2), 10 ** rng.uniform(-1.3, -0.3)
    top = span * rng.uniform(1.5, 3)
    force = 3.0 * M * top**2 / span
    F_c = force * rng.uniform(0.2, 0.5)
    F_v = F_c / top * rng.uniform(0.2, 1.0)
    gain = 0.25 * force + 0.2 * F_c
    ref = moves(rng, span, top * np.array([0.1, 0.25, 0.5, 1.0]))
    sigma = F_c / (2.0 * span * size.get("gives", 2e-5))
    carriage = Carriage(
        M, F_v, F_c, F_c * size.get("sticks", 1.0), top * size.get("falls", 0.08), sigma, 0.06 * np.sqrt(sigma * M),
        size.get("tilt", 0.0), size.get("push", 0.0) * F_c,
    )  # fmt: skip
    loop = Loop(15.0, 60.0 * M / gain, gain, 2e-6 * span)
    x, u = moved(carriage, loop, ref, rng.standard_normal(len(ref)))
    case = {
        "sample_rate": 1 / DT, "parameters": {"M": M * rng.uniform(0.9, 1.1)},
        "sensors": {"x_resolution_m": loop.step}, "drive": {"newton_per_volt": gain, "limit_volt": LIMIT},
        "controller": {"kind": "cascade_p_v", "kp": loop.kp, "kv": loop.kv}, "controller_known": True,
    }  # fmt: skip
    write(folder, {"t": DT * np.arange(len(ref)), "ref": ref, "u": u, "x": x}, case)
    return what


def judged(hidden: dict[str, tuple[str, ...]], out: Path) -> dict[str, Any]:
    """Number of right diagnoses (all effects and no other); `ambiguous` with all effects counts separately."""
    right, among, others = 0, 0, {}
    for case, what in hidden.items():
        told = json.loads((out / case / "diagnosis.json").read_text())
        given, true = {e["name"] for e in told["effects"]}, {*PLAIN, *what}
        exact = told["verdict"] == "named" and true <= given <= {*true, BRISTLES}
        tie = told["verdict"] == "ambiguous" and true <= given
        right, among = right + exact, among + tie
        if not exact and not tie:
            others[case] = {"true": sorted(true), "verdict": told["verdict"], "told": sorted(given)}
    return {"cases": len(hidden), "right": right, "ambiguous_with_it": among, "others": others}


def told(found: dict[str, Any]) -> list[str]:
    """Result as lines of text."""
    return [f"{found['right']} of {found['cases']} right, {found['ambiguous_with_it']} more ambiguous with all effects"]


if __name__ == "__main__":
    run(__doc__, conceal, judged, told, count=8, seed=100)
