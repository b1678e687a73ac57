"""Diagnosis of open-loop drives with a speed sensor and no position sensor, some with a concealed effect.

    python benchmarks/speed_machines.py [--count 48] [--seed 60] [--jobs 2] [--out FOLDER] [--json]

`rtctl prove` conceals effects in machines under position control. This benchmark has machines as in benchmarks of
system identification: 10 to 20 s at 50 to 1000 Hz of a motor with viscous friction under random steps, levels or a
multisine, speed noise of 0.3 to 1.5 %, nominal values off by up to 12 %. The equations share no code with plants/ or
rtctl/diagnose/. An effect is drawn again where other values of mass and friction reduce its residual below the noise.
Case k of a seed is reproducible.

Source for the kind: Wigren & Schoukens, Three free data sets for development and benchmarking in nonlinear system
identification, ECC 2013 (coupled electric drives, whose sensor does not know direction).
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from concealed import run, write
from numba import njit
from scipy.optimize import least_squares

STEP = 50e-6  # s, integration step
FIT = ("heldout_nrmse_before", "heldout_nrmse_after", "noise_floor")
OFF = 0.12  # largest relative error of the nominal values
NAMES = {
    "dry": "friction.coulomb", "dead": "drive.deadband", "unequal": "drive.gain_asymmetry", "offset": "drive.offset",
    "limit": "drive.saturation", "lag": "drive.lag", "delay": "timing.delay", "rings": "structure.resonance",
    "blind": "sensor.rectified", "spring": "load.spring",
}  # fmt: skip
FIELDS = {"rings": ("part", "stiff", "damp")}  # fields of a drive for effects with other names
DRAWS, SHOWS = 20, 1.0  # most draws, and least residual of the best fit without the effect over noise
KINDS = (
    (), (), ("dry",), ("dead",), ("unequal",), ("offset",), ("limit",), ("lag",), ("delay",), ("rings",), ("blind",),
    ("spring",), ("blind", "rings"), ("blind", "dry"), (),
)  # fmt: skip


class Drive(NamedTuple):
    """Motor, load and possible effects; 0 for an absent effect."""

    M: float
    F: float
    K: float
    dry: float = 0.0  # N
    dead: float = 0.0  # V
    unequal: float = 0.0
    offset: float = 0.0  # V
    limit: float = 1e9  # V
    lag: float = 0.0  # s
    delay: float = 0.0  # s
    spring: float = 0.0  # N/m
    part: float = 0.0  # kg, mass of the resonance
    stiff: float = 0.0  # N/m, stiffness of the resonance
    damp: float = 0.0  # N s/m


@njit
def speed_of(d: Drive, u: np.ndarray, dt: float, fine: int) -> np.ndarray:
    """Speed (n,) at each sample under held volts (n,), by semi-implicit Euler with `fine` steps per sample."""
    out, h, late = np.zeros(len(u)), dt / fine, round(d.delay / dt * fine)
    x = v = y = w = a = 0.0
    for k in range(len(u)):
        out[k] = v
        for i in range(fine):
            at = k * fine + i - late
            c = (u[at // fine] if at >= 0 else 0.0) + d.offset
            c = np.sign(c) * max(abs(c) - d.dead, 0.0)
            c = min(max(c * (1.0 + d.unequal * np.sign(c)), -d.limit), d.limit)
            a = a + h / d.lag * (c - a) if d.lag > 0.0 else c
            pull = d.stiff * (x - y) + d.damp * (v - w)
            v += h / d.M * (d.K * a - d.F * v - d.dry * np.tanh(v / 3e-3) - d.spring * x - pull)
            x += h * v
            if d.part > 0.0:
                w += h / d.part * pull
                y += h * w
    return out


def volts(rng: np.random.Generator, t: np.ndarray) -> np.ndarray:
    """Voltages (n,): random signs, random levels, or a multisine."""
    n, rate = len(t), 1.0 / (t[1] - t[0])
    kind = rng.integers(3)
    if kind == 2:
        sines = [np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) for f in np.arange(0.2, 3.0, 0.37)]
        return np.sum(sines, axis=0) / np.std(np.sum(sines, axis=0))
    hold = max(2 + kind, int(rate * (rng.uniform(0.05, 0.25) if kind == 0 else rng.uniform(0.3, 1.0))))
    levels = rng.choice([-1.0, 1.0], n // hold + 1) if kind == 0 else rng.uniform(-1.5, 1.5, n // hold + 1)
    return np.repeat(levels, hold)[:n]


def drawn(rng: np.random.Generator, what: tuple[str, ...], u: np.ndarray, rate: float) -> Drive:
    """Drive with these effects, scaled by its command and its time constant."""
    slow, M = rng.uniform(0.1, 0.6), rng.uniform(0.5, 3.0)
    d, rms = Drive(M, M / slow, rng.uniform(0.5, 3.0) * M / slow), float(np.std(u))
    part = rng.uniform(0.2, 0.7) * M
    ring = 2 * np.pi * (rng.uniform(1.5, 4.0) * min(1.0, rate / 100) if rate < 500 else rng.uniform(4.0, 20.0))
    sizes: dict[str, dict[str, float]] = {
        "dry": {"dry": 0.15 * d.K * rms}, "dead": {"dead": 0.12 * rms}, "unequal": {"unequal": 0.08},
        "offset": {"offset": 0.08 * rms}, "limit": {"limit": 0.75 * float(np.abs(u).max())},
        "lag": {"lag": max(0.06 * slow, 1.2 / rate)}, "delay": {"delay": max(0.05 * slow, 1.5 / rate)},
        "spring": {"spring": 0.5 * M / slow**2}, "blind": {},
        "rings": {"part": part, "stiff": part * ring**2, "damp": 0.16 * part * ring},
    }  # fmt: skip
    return d._replace(**{name: size for effect in what for name, size in sizes[effect].items()})


def left(d: Drive, name: str, u: np.ndarray, v: np.ndarray, rate: float) -> float:
    """Rms residual of the best drive without effect `name`, over mass, friction and gain."""
    none = d if name == "blind" else d._replace(**{f: Drive._field_defaults[f] for f in FIELDS.get(name, (name,))})
    blind = name != "blind" and v.min() >= 0.0

    def error(x: np.ndarray) -> np.ndarray:
        M, F = np.exp(np.clip(x, -1.0, 1.0))
        made = speed_of(none._replace(M=d.M * M, F=d.F * F), u, 1 / rate, round(1 / rate / STEP))
        return (np.abs(made) if blind else made) - v

    return float(np.sqrt(2.0 * least_squares(error, np.zeros(2), diff_step=1e-3, max_nfev=15).cost / len(v)))


def conceal(folder: Path, seed: int, k: int) -> tuple[str, ...]:
    """Write case k as a bundle; returns its effects."""
    rng, what = np.random.default_rng([seed, k]), KINDS[k % len(KINDS)]
    for _ in range(DRAWS):
        rate = float(rng.choice([50.0, 100.0, 200.0, 1000.0]))
        t = np.arange(int(rate * (rng.uniform(10, 20) if rate < 1000 else 10))) / rate
        u = volts(rng, t)
        d = drawn(rng, what, u, rate)
        v = speed_of(d, u, 1 / rate, round(1 / rate / STEP))
        noise, v = rng.uniform(0.003, 0.015) * np.std(v), np.abs(v) if "blind" in what else v
        if all(left(d, name, u, v, rate) > SHOWS * noise for name in what):
            break
    shown = v + noise * rng.standard_normal(len(v))
    M, F, K = (value * (1.0 + rng.uniform(-OFF, OFF)) for value in (d.M, d.F, d.K))
    case = {
        "sample_rate": rate, "parameters": {"M": M, "F_v": F}, "sensors": {},
        "drive": {"newton_per_volt": K, "limit_volt": 10.0}, "controller": {"kind": "none"}, "controller_known": False,
    }  # fmt: skip
    write(folder, {"t": t, "u": u, "speed": shown}, case)
    return tuple(sorted(NAMES[name] for name in what))


def judged(hidden: dict[str, tuple[str, ...]], out: Path) -> dict[str, Any]:
    """Number of right diagnoses; `ambiguous` with the right names among others counts separately."""
    right, among, names, alarms, gaps, wrong = 0, 0, [], 0, [], {}
    for case, true in hidden.items():
        told = json.loads((out / case / "diagnosis.json").read_text())
        given, verdict = sorted(e["name"] for e in told["effects"]), told["verdict"]
        exact = verdict in ("named", "nothing") and tuple(given) == true
        tie = verdict == "ambiguous" and bool(true) and set(true) <= set(given)
        right, among, alarms = right + exact, among + tie, alarms + (not true and verdict != "nothing")
        names += [name in true for name in given] if verdict == "named" else []
        if verdict == "named":
            before, after, floor = (told["fit"][key] for key in FIT)
            gaps.append((before - after) / (before - floor))
        if not exact and not tie:
            wrong[case] = {"true": true, "verdict": verdict, "told": given}
    return {
        "cases": len(hidden), "right": right, "ambiguous_with_it": among, "false_alarms": alarms,
        "nothing_missing": sum(not true for true in hidden.values()), "names_given": len(names),
        "names_right": int(sum(names)), "gap_closed_median": float(np.median(gaps)) if gaps else None, "others": wrong,
    }  # fmt: skip


def told(found: dict[str, Any]) -> list[str]:
    """Result as lines of text."""
    return [
        f"{found['right']} of {found['cases']} right, {found['ambiguous_with_it']} more ambiguous with the right names",
        f"false alarms {found['false_alarms']} of {found['nothing_missing']}",
        f"names right {found['names_right']} of {found['names_given']}, gap closed {found['gap_closed_median']}",
    ]


if __name__ == "__main__":
    run(__doc__, conceal, judged, told, count=48, seed=60)
