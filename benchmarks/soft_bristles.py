"""Diagnosis of oscillators with a hysteretic spring; the nominal model has mass, damper and spring.

    python benchmarks/soft_bristles.py [--count 8] [--seed 100] [--jobs 2] [--out FOLDER] [--json]

Rubber, wire rope and bolted joints have this hysteresis: bristles that bend over much of the travel, w' = v / z (1 -
|w|^n (g sign(v w) + d)). With n = g = 1 and d = 0 it is the law of `friction.presliding` over dry friction. Where
g + d = 1 the bristle finally slides. One kind never slides and has no name in the library; one kind is linear. 12 s at
750 Hz in open loop under a smooth multisine, noise of 0.1 % of the travel. Case k of a seed is reproducible. The
equations share no code with plants/ or rtctl/diagnose/.

Source: Bouc 1967; Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. 102 (1976); Noel & Schoukens,
Hysteretic benchmark with a dynamic nonlinearity (2016) for the kind.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from concealed import run, write
from numba import njit

RATE, FINE, SECONDS, LINES = 750.0, 40, 12.0, 25  # Hz, integration steps per sample, s, lines of the multisine
LAW = {"friction.coulomb", "friction.presliding"}


class Kind(NamedTuple):
    """Hysteresis of the spring, missing in the nominal model."""

    force: float  # share of the rms of the elastic force
    z: float  # share of the travel after which it slides
    n: float = 1.0
    g: float = 1.0
    d: float = 0.0
    named: int = 1  # whether the library has names for it


NONE = Kind(0.0, 1.0, named=0)
KINDS = (
    NONE,
    Kind(0.3, 0.03),
    Kind(0.5, 0.1),
    Kind(1.0, 0.3),
    Kind(0.1, 0.1),
    Kind(0.4, 0.1, n=2.0),
    Kind(0.4, 0.1, g=0.7, d=0.3),
    Kind(0.5, 0.5, g=0.8, d=-1.1, named=0),  # values of Noel & Schoukens
)


@njit
def moved(m: float, c: float, k: float, F: float, z: float, kind: Kind, u: np.ndarray) -> np.ndarray:
    """Positions (n,) in m under the force `u` (n * FINE,) in N; `F` in N and `z` in m are bristle parameters."""
    x = v = w = 0.0
    shown, h = np.empty(len(u) // FINE), 1.0 / RATE / FINE
    for i in range(len(u)):
        if i % FINE == 0:
            shown[i // FINE] = x
        w += h * v / z * (1.0 - abs(w) ** kind.n * (kind.g * np.sign(v * w) + kind.d))
        v += h * (u[i] - c * v - k * x - F * w) / m
        x += h * v
    return shown


def conceal(folder: Path, seed: int, number: int) -> Kind:
    """Write a case as a bundle; returns its kind."""
    rng, kind = np.random.default_rng(seed + number), KINDS[number % len(KINDS)]
    m, own = 10 ** rng.uniform(-1, 1), rng.uniform(10, 40)  # kg, Hz
    k = m * (2 * np.pi * own) ** 2
    c = 2 * rng.uniform(0.01, 0.04) * np.sqrt(k * m)
    count, fine = int(RATE * SECONDS), (np.arange(int(RATE * SECONDS) * FINE) + 0.5) / RATE / FINE
    waves = [(f, rng.uniform(0, 2 * np.pi)) for f in own * np.linspace(0.2, 3.0, LINES) * rng.uniform(0.95, 1.05)]

    def force(t: np.ndarray) -> np.ndarray:
        return sum(np.cos(2 * np.pi * f * t + p) for f, p in waves) * np.minimum(1.0, 15 * t)

    t = np.arange(count) / RATE
    linear = moved(m, c, k, 0.0, 1.0, NONE, force(fine))
    F = kind.force * k * np.std(linear)
    x = moved(m, c, k, F, kind.z * np.ptp(linear), kind, force(fine))
    x += 1e-3 * x.std() * rng.standard_normal(count)
    owner = {name: value * rng.uniform(0.95, 1.05) for name, value in (("M", m), ("F_v", c), ("k", k))}
    case = {
        "sample_rate": RATE, "parameters": owner, "sensors": {"x_resolution_m": 0.0},
        "drive": {"newton_per_volt": 1.0, "limit_volt": 1e4}, "controller": {"kind": "none"}, "controller_known": False,
    }  # fmt: skip
    write(folder, {"t": t, "u": force(t), "x": x}, case)
    return kind


def judged(hidden: dict[str, Kind], out: Path) -> dict[str, Any]:
    """Number of right diagnoses: sliding kinds with exactly both names, the others without a name.

    Both names with a third name, then of the form of the law, count separately.
    """
    right, bent, others = 0, 0, {}
    for case, kind in hidden.items():
        told = json.loads((out / case / "diagnosis.json").read_text())
        given = {e["name"] for e in told["effects"]}
        wanted = "named" if kind.named else "unnamed" if kind.force else "nothing"
        if told["verdict"] == wanted and given == (LAW if kind.named else set()):
            right += 1
        elif kind.force and given > LAW:
            bent += 1
        else:
            others[case] = {"true": kind._asdict(), "verdict": told["verdict"], "told": sorted(given)}
    return {"cases": len(hidden), "right": right, "with_another": bent, "others": others}


def told(found: dict[str, Any]) -> list[str]:
    """Result as lines of text."""
    return [f"{found['right']} of {found['cases']} right, {found['with_another']} more with another name beside both"]


if __name__ == "__main__":
    run(__doc__, conceal, judged, told, count=8, seed=100)
