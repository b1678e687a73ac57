"""Table of a sensor's correction over its travel, by the effects' own lines, to be added to the reading."""

from typing import Any

import numpy as np

from rtctl.improve.found import Found
from rtctl.improve.lines import swept
from rtctl.machines.base import DESCRIBED

VALUES = 256
ROOM = 1.2  # of the travel that the table covers


def of(found: Found, travel: tuple[float, float]) -> tuple[dict[str, Any], bool] | None:
    """Settings of an error table over the travel (unit of the reference) and whether the sensor has an absolute zero.

    None where no effect misreads the feedback's sensor by its position alone.
    """
    config = found.config
    if config.kind != DESCRIBED:
        return None
    from rtctl.machines.described_parts import parts_of

    parts = parts_of(config)
    sensor = parts.machine.sensors[parts.feedback]
    entries = [e.entry for e in found.effects if e.entry.node == parts.feedback and "table" in e.term.remedies]
    if not entries or parts.is_speed:
        return None
    middle, span = 0.5 * sum(travel), max(travel[1] - travel[0], 1e-9)
    period = ROOM * span
    x = middle + period * (np.arange(2 * VALUES) / (2 * VALUES) - 0.5)
    shown = swept(entries, "reading", config.kind, x)
    if np.any(np.diff(shown) <= 0):
        return None
    step = period / VALUES
    index = np.arange(VALUES)
    grid = step * index
    grid = grid + period * np.round((middle - grid) / period)  # the turn of the table that lies about the middle
    error = np.interp(grid, shown, x - shown)
    values = {"period": float(f"{period:.8g}"), "values": [float(f"{v:.6g}") for v in error]}
    return values, sensor.counts_per_unit is None
