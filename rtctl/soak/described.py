"""Ranges of a soak on a described machine: moves as large and as fast as those of its reference."""

from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.laws import reference
from rtctl.machines.described_parts import parts_of, signals
from rtctl.machines.described_plant import converter, is_counter
from rtctl.machines.profile import Range

DESCRIBED_GAINS = {"law.position.gain": (0.8, 1.05), "law.position.velocity_gain": (0.9, 1.1)}
SETTLE = 3.0  # s from the end of a move until the machine must be at its target
LAST = 0.1  # tolerance at the target for dry friction, as a fraction of the largest move


def described_range(config: Any) -> Range:
    """Ranges of a soak, from the reference of the config. Raises UserError where the reference does not move."""
    parts, seen = parts_of(config), signals(config)
    table = reference.build(config.reference, 1.0 / config.loop.rate)
    t, r = table.t[: table.n], table.r[: table.n]
    span = float(np.ptp(r))
    if span == 0.0:
        raise UserError(f"{config.name}: a soak moves as far as the reference does; give the config one that moves")
    moving = np.diff(r)[np.diff(t) > 0] / np.diff(t)[np.diff(t) > 0]
    fastest = float(np.abs(moving).max()) if moving.size and np.abs(moving).max() > 0 else span
    jumps = np.abs(np.diff(r)[np.diff(t) == 0])
    sensor = parts.machine.sensors[parts.feedback]
    return Range(
        position=seen.position, error=seen.error, outputs=seen.outputs, counts=sensor.column, truth=seen.truth,
        tensions=(), truth_tensions=(), travel=span, jump=float(jumps.max()) if jumps.size else 0.01 * span,
        rate=(0.2 * fastest, fastest), settle=SETTLE, tolerance=LAST * span, stretch=2.0,
        counters=sum(is_counter(s) for s in parts.machine.sensors.values()), inputs=0, gains=DESCRIBED_GAINS,
    )  # fmt: skip


def described_counts(config: Any) -> float:
    """Counts per unit of the truth column; nan where the feedback sensor has no counts."""
    sensor = parts_of(config).machine.sensors[parts_of(config).feedback]
    return float(sensor.scale) if is_counter(sensor) else float("nan")


def full_commands(config: Any) -> tuple[float, float]:
    """Lowest and highest command of any drive, in its unit, with half a code for rounding."""
    limit, drives = config.law.limit, config.machine.drives
    low = -limit.high if limit.low is None else limit.low
    most = max(abs(low), limit.high) * max(1.0, *(abs(s) for s in config.law.shares.values()), 0.0)
    half = max(converter(config, n).volts_per_code for n in range(len(drives))) / 2
    return -most - half, most + half


def rounding_of(config: Any) -> float:
    """Largest difference of a row's command from the law's: half a code, and one code at the end of the scale."""
    return 2.0 * max(converter(config, n).volts_per_code for n in range(len(config.machine.drives)))
