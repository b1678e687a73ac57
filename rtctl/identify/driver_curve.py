"""Characteristic of a motor driver: current over voltage with the motor blocked, 0 to 3 V in steps of 0.1 V.

    I = I_0                      V < V_k         constant current
    I = I_0 + g (V - V_k)        V >= V_k        by least squares                                            (12.3)

Every voltage is held for 7500 samples after the settling time; the current is the mean of the samples. The current of
the 1 ohm shunt is the column `truth_current` of the emulator, and the column `current` on a bench.

Source: thesis 12.2, figure 12.3. Erratum: the text gives 0.23 A at 3.0 V, its equation 0.262 A.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify.bench import changed, need
from rtctl.identify.records import Record
from rtctl.machines.profile import AMPLIFIER
from rtctl.plants import ldu

SAMPLES = 7500  # samples for each voltage
SETTLE = 0.1  # s, settling time before the samples
HELD = 1e5  # N, holding force of the brake
GAIN = 10.0  # V/m of the law from reference to volts; a count of the encoder changes no output code
BEND = 0.2  # share of the slope: points on a line of smaller slope belong to the flat part


class Level(NamedTuple):
    volts: float  # V, mean output of the board, signed by direction
    ampere: float  # mean current
    deviation: float  # A, standard deviation of the samples
    samples: int


class DriverCurve(NamedTuple):
    levels: tuple[Level, ...]
    I_0: float  # A, below the knee; 0 without flat part
    V_k: float  # V, knee; 0 without flat part
    gain: float  # A/V, above the knee
    gain_half: float  # A/V, half width of the 95 % interval
    at_3: float  # A, at 3 V by the fit
    worst: float  # A, largest deviation from the fit
    torque: float | None  # Nm, motor torque at I_0


def driver_config(config: Any, highest: float = 3.0, step: float = 0.1) -> Any:
    """Config with blocked carriage that writes 0 to `highest` V through a proportional law.

    The amplifier is written without inversion of its characteristic. Raises UserError for `highest` above 3.0 V, where
    the amplifier runs away.
    """
    need(config.kind, config.name, AMPLIFIER)
    if not 0 < step <= highest <= 3.0 + 1e-9:
        raise UserError(
            f"{config.name}: 0 to {highest:g} V in steps of {step:g} V; the amplifier runs away above 3.0 V"
        )
    hold = SETTLE + (SAMPLES + 1) / config.loop.rate
    steps = [{"at": 0.1 + k * hold, "to": k * step / GAIN} for k in range(1, round(highest / step) + 1)]
    steps.append({"at": 0.1 + (len(steps) + 1) * hold, "to": 0.0})
    changes = {
        "law.position": {"kind": "pi_velocity", "gain": GAIN},
        "law.friction": {"F_c": 0.0},
        "law.shaper": {},
        "law.limit": {"high": 3.0},
        "amplifier.compensate": False,
        "amplifier.limit": 3.0,
        "plant.parameters.F_c": HELD,
        "safety.frozen_time": 0,
        "safety.following_error": 0,
        "safety.disagreement": 0,
        "safety.current_time": 0,
        "reference": {"steps": steps},
    }
    return changed(config, changes)


def driver_curve(record: Record, least: int = SAMPLES) -> DriverCurve:
    """Driver characteristic from every interval of at least `least` samples at one voltage, both directions together.

    Raises NoAnswer where the motor turns or for fewer than 8 voltages, UserError where no current was recorded.
    """
    column = "current" if "current" in record.columns else "truth_current"
    if column not in record.columns:
        raise UserError(
            f"{record.source} has no column 'current' (A, over the shunt), nor 'truth_current' of an emulator"
        )
    u, current, counts = record["u"], record[column], record["encoder_counts"]
    settle = round(SETTLE * (1.0 / record.dt))
    edges = np.concatenate(([0], np.flatnonzero(np.diff(u) != 0.0) + 1, [len(u)]))
    levels = []
    for a, b in pairwise(edges):
        if b - a < settle + least:
            continue
        rows = slice(a + settle, a + settle + least)
        if np.ptp(counts[rows]) > 1:
            at = record["t"][a]
            raise NoAnswer(f"{record.source}: the motor turns from {at:.2f} s on; this curve is of a motor held fast")
        levels.append(Level(float(u[a]), float(current[rows].mean()), float(current[rows].std()), least))
    known = {round(level.volts, 3): level for level in levels}
    levels = [known[volts] for volts in sorted(known)]
    if len(levels) < 8:
        raise NoAnswer(f"{record.source}: {len(levels)} voltages held for {least} samples; a curve takes at least 8")
    K_m = ldu.parameters(record.config.plant).K_m1 if record.profile.has(AMPLIFIER) else None
    return fit(tuple(levels), K_m)


def fit(levels: tuple[Level, ...], K_m: float | None = None) -> DriverCurve:
    """Fit of (12.3) to absolute levels. The knee is the intersection of the flat part and the line."""
    V = np.abs([level.volts for level in levels])
    I = np.abs([level.ampere for level in levels])  # noqa: E741 - usual symbol of a current
    order = np.argsort(V, kind="stable")
    V, I = V[order], I[order]  # noqa: E741
    overall = np.polyfit(V[len(V) // 2 :], I[len(V) // 2 :], 1)[0]
    best: tuple[float, int] | None = None
    for n in range(0, len(V) - 3):  # the first n points form the flat part
        if n == 1 or (n and abs(np.polyfit(V[:n], I[:n], 1)[0]) > BEND * abs(overall)):
            continue
        M = np.column_stack((np.ones(len(V) - n), V[n:]))
        line = np.linalg.lstsq(M, I[n:], rcond=None)[0]
        cost = float(np.sum((I[n:] - M @ line) ** 2) + (np.sum((I[:n] - I[:n].mean()) ** 2) if n else 0.0))
        if best is None or cost < best[0] * (1 - 1e-6) - 1e-18:
            best = (cost, n)
    assert best is not None
    n = best[1]
    M = np.column_stack((np.ones(len(V) - n), V[n:]))
    level, gain = np.linalg.lstsq(M, I[n:], rcond=None)[0]
    I_0 = float(I[:n].mean()) if n else 0.0
    V_k = float((I_0 - level) / gain) if n else 0.0
    model = np.where(np.arange(len(V)) < n, I_0, level + gain * V)
    rest = I - model
    half = 2.0 * np.sqrt(np.linalg.inv(M.T @ M)[1, 1] * np.sum(rest[n:] ** 2) / max(len(V) - n - 2, 1))
    return DriverCurve(
        levels, I_0, V_k, float(gain), float(half), float(level + 3.0 * gain), float(np.abs(rest).max()),
        None if K_m is None else I_0 * K_m,
    )  # fmt: skip
