"""Recordings of small machines by explicit integration, independent of the fit simulation."""

from pathlib import Path

import numpy as np

from rtctl.case.format2 import read_case
from rtctl.diagnose.model.recording import record_of

FINER = 20  # integration steps per row
ROTOR = {
    "bodies": {"rotor": {"inertia": 1e-3, "viscous": 5e-4}},
    "drives": {"motor": {"body": "rotor", "column": "tau", "kind": "force", "unit": "Nm"}},
    "sensors": {"encoder": {"body": "rotor", "measures": "position", "column": "counts", "counts_per_unit": 1592.0}},
}
ROD = {
    "bodies": {"rod": {"inertia": 3.3e-3, "viscous": 3e-4, "gravity": {"mass": 0.15, "arm": 0.15}}},
    "sensors": {"encoder": {"body": "rod", "measures": "position", "column": "x", "resolution": 1e-5}},
}
SCREW = {
    "bodies": {"screw": {"inertia": 1e-4}, "table": {"mass": 20.0}},
    "joints": {"nut": {"from": "screw", "to": "table", "ratio": 8e-4}},
    "sensors": {
        "resolver": {"body": "screw", "measures": "position", "column": "turn", "resolution": 1e-4},
        "glass": {"body": "table", "measures": "position", "column": "way", "resolution": 1e-7},
    },
}


def case_of(machine, rate, **more):
    """A case.json of a machine without a delay."""
    return {"format": 2, "sample_rate": rate, "machine": machine, "delay_samples": 0.0, "tolerance": {"default": 0.05},
            "controller": {"kind": "unknown"}, **more}  # fmt: skip


def record(case, name="bench", **columns):
    """The record of these columns (n,)."""
    n = len(next(iter(columns.values())))
    whole = {"t": np.arange(n) / case["sample_rate"], **columns}
    return record_of(whole, read_case(case, name), Path(name) / "recording.parquet")


def moved(u, rate, inertia, force, dry=0.0, x=0.0, v=0.0, finer=FINER):
    """Positions (n,) of a body under the force u (n,) + force(x, v) and dry friction, in `finer` steps a tick."""
    out, h = [], 1.0 / rate / finer
    for given in u:
        out.append(x)
        for _ in range(finer):
            push = given + force(x, v)
            sliding = np.sign(v) if v else np.sign(push) * (abs(push) > dry)
            change = h * (push - dry * sliding) / inertia if sliding else 0.0
            new = 0.0 if v * (v + change) < 0.0 else v + change
            x, v = x + 0.5 * h * (v + new), new
    return np.array(out)


def torque(sign, seed, rate=500.0, seconds=3.0):
    """Levels (n,) of one sign, every fourth zero; the rotor never reverses."""
    n = round(rate * seconds)
    levels = np.random.default_rng(seed).uniform(0.06, 0.12, n // 100 + 1)
    levels[3::4] = 0.0
    return sign * np.repeat(levels, 100)[:n]


def rotor(sign, seed, dry=0.03, rate=500.0, **more):
    """A rotor with rotation in one direction."""
    u = torque(sign, seed, rate)
    x = moved(u, rate, 1e-3, lambda x, v: -5e-4 * v, dry)
    name = "left" if sign > 0 else "right"
    return record(case_of(ROTOR, rate, **more), name, tau=u, counts=np.floor(1592.0 * x))


def rounded(x, step):
    """Values rounded to steps."""
    return step * np.round(x / step)
