"""Gain schedule: a factor on the controller's output that follows the reel radii.

    off      1
    model    K_p(reference radii) / K_p(R_drive, R_other), but no less than `floor`: the loop gain K_p G stays at its
             design value, or is above it
    margin   from a table over (R_drive, R_other), interpolated: for tables that keep a stability margin

The process gain (`process_gain`) says what one motor does to the capstan; the other direction swaps the reels, since
the unit is symmetric. A fixed gain that has 5.2 dB of gain margin at 38/22 mm has 1.2 dB at 40/40 and 20.9 dB at
20/20: low-frequency gain alone does not set the margin, so `margin` takes a table designed on the full model.

Dry friction of a motor leaves an error of tau / (G K_m): it grows where the factor is below 1, whatever the process
gain is. So the floor is 1, and the schedule only adds gain where the larger reel of a pair pulls.

Source: thesis chapter 9 (gain scheduling recommended), process gain of 4.1-4.17. The loop gain is
smaller where the larger reel of a pair pulls, as chapter 9 says, and largest where both reels are full.
"""

from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws import process_gain
from rtctl.laws.process_gain import ProcessGainParams, ProcessGainSettings

MOST = 8  # radii on an axis of the table
OFF, MODEL, MARGIN = 0, 1, 2
MODES = {"off": OFF, "model": MODEL, "margin": MARGIN}


class RadiusTableSettings(Settings):
    R_drive: list[float] = Field(min_length=2, max_length=MOST, description="m, rising; radius of the driving reel")
    R_other: list[float] = Field(min_length=2, max_length=MOST, description="m, rising; radius of the other reel")
    factor: list[list[float]] = Field(description="one row per R_drive, one column per R_other")


class GainScheduleSettings(Settings):
    mode: Literal["off", "model", "margin"] = Field(default="off", description="what the factor follows")
    R1_reference: float = quantity(0.038, unit="m", gt=0, help="driving reel for which the gain was designed")
    R2_reference: float = quantity(0.022, unit="m", gt=0, help="other reel for which the gain was designed")
    floor: float = quantity(
        1.0, unit="", ge=0, help="least factor of mode model; below 1 the error by dry friction grows at full reels"
    )
    process: ProcessGainSettings = ProcessGainSettings()
    table: RadiusTableSettings | None = Field(default=None, description="factors, for mode margin")


class GainScheduleParams(NamedTuple):
    mode: int
    K_reference: float  # rad/s^2/V
    floor: float
    process: ProcessGainParams
    n_drive: int
    n_other: int
    R_drive: np.ndarray  # m, (MOST,)
    R_other: np.ndarray  # m, (MOST,)
    factor: np.ndarray  # (MOST, MOST)


GAIN_SCHEDULE_STATE = state(factor=float)  # the factor in force


def build(settings: GainScheduleSettings, dt: float) -> GainScheduleParams:
    """Parameters; `dt` does not matter. Raises ValueError where the table is missing or not a table."""
    process = process_gain.build(settings.process, dt)
    K_reference = 0.0
    if settings.mode == "model":  # the step is compiled here, which takes half a second
        K_reference = float(process_gain.step(process, settings.R1_reference, settings.R2_reference))
    n_drive, n_other, R_drive, R_other, factor = 0, 0, np.zeros(MOST), np.zeros(MOST), np.ones((MOST, MOST))
    if settings.table is not None:
        n_drive, n_other = _fill(settings.table, R_drive, R_other, factor)
    elif settings.mode == "margin":
        raise ValueError("mode margin takes a table of factors; give one under 'table', or take mode model")
    return GainScheduleParams(
        MODES[settings.mode], K_reference, settings.floor, process, n_drive, n_other, R_drive, R_other, factor
    )


def _fill(table: RadiusTableSettings, R_drive: Any, R_other: Any, factor: Any) -> tuple[int, int]:
    shape = len(table.R_drive), len(table.R_other)
    if {len(row) for row in table.factor} != {shape[1]} or len(table.factor) != shape[0]:
        raise ValueError(f"factor must have {shape[0]} rows of {shape[1]} numbers, one for each pair of radii")
    for name, axis in (("R_drive", table.R_drive), ("R_other", table.R_other)):
        if np.any(np.diff(axis) <= 0):
            raise ValueError(f"{name} must rise from one radius to the next")
    if np.min(table.factor) <= 0:
        raise ValueError("factor must be positive everywhere; a gain of another sign would drive the loop away")
    R_drive[: shape[0]], R_other[: shape[1]] = table.R_drive, table.R_other
    factor[: shape[0], : shape[1]] = table.factor
    return shape


@tick
def step(p, s, R1, R2, direction):
    """Factor for the reel radii `R1` and `R2` in m.

    `direction` says who drives: positive reel 1, negative reel 2, zero both (the mean of the two). With allocation
    `pull` pass the unscaled command itself.
    """
    if direction > 0:
        s.factor = _one(p, R1, R2)
    elif direction < 0:
        s.factor = _one(p, R2, R1)
    else:
        s.factor = 0.5 * (_one(p, R1, R2) + _one(p, R2, R1))
    return s.factor


@tick
def _one(p, R_drive, R_other):
    if p.mode == MODEL:
        return max(p.K_reference / process_gain.step(p.process, R_drive, R_other), p.floor)
    if p.mode == MARGIN:
        return _interpolate(p, R_drive, R_other)
    return 1.0


@tick
def _interpolate(p, R_drive, R_other):
    """Bilinear between the radii of the table, constant beyond them."""
    i = _interval(p.R_drive, p.n_drive, R_drive)
    j = _interval(p.R_other, p.n_other, R_other)
    x = min(max((R_drive - p.R_drive[i]) / (p.R_drive[i + 1] - p.R_drive[i]), 0.0), 1.0)
    y = min(max((R_other - p.R_other[j]) / (p.R_other[j + 1] - p.R_other[j]), 0.0), 1.0)
    low = (1.0 - y) * p.factor[i, j] + y * p.factor[i, j + 1]
    high = (1.0 - y) * p.factor[i + 1, j] + y * p.factor[i + 1, j + 1]
    return (1.0 - x) * low + x * high


@tick
def _interval(axis, n, R):
    i = 0
    while i < n - 2 and axis[i + 1] <= R:
        i += 1
    return i
