"""Inverse of a drive's static curve: the effects' own lines swept over the commands, and inverted.

The inverse crosses a dead band with a slope of at most `STEEP`, so that noise about zero does not jump from one end of
the dead band to the other.
"""

from typing import Any

import numpy as np

from rtctl.improve.found import Found
from rtctl.improve.lines import swept
from rtctl.machines.base import DESCRIBED
from rtctl.plants.physics.place import place

ROWS = 2001
POINTS = 41
STEEP = 40.0  # largest slope of the inverse


def inverse(found: Found) -> list[tuple[float, float]] | None:
    """Points (wanted, command) of the inverse over the range of the law's limit, of all static effects of the drive
    that the law commands; None where there are no static effects or the curve has no inverse."""
    config = found.config
    entries = [e.entry for e in found.effects if e.term.static and e.term.axis == "command" and _commanded(config, e)]
    if not entries:
        return None
    top = float(config.law.limit.high)
    asked = np.linspace(-top, top, ROWS)
    given = swept(entries, "command", config.kind, asked)
    slope = np.gradient(given, asked)
    given = given + np.cumsum(np.maximum(1.0 / STEEP - slope, 0.0)) * (asked[1] - asked[0])
    given -= np.interp(0.0, asked, given) - float(swept(entries, "command", config.kind, np.zeros(1))[0])
    given = np.maximum.accumulate(given + 1e-9 * np.arange(ROWS))
    curvature = np.abs(np.gradient(np.gradient(given, asked), asked))
    weight = np.cumsum(0.02 * curvature.max() + curvature)  # more points where the curve bends
    at = np.unique(np.searchsorted(weight, np.linspace(weight[0], weight[-1], POINTS)))
    at = np.unique(np.concatenate([[0, ROWS // 2, ROWS - 1], np.minimum(at, ROWS - 1)]))
    return [(float(f"{given[i]:.6g}"), float(f"{asked[i]:.6g}")) for i in _rising(given, asked, at)]


def _rising(given: np.ndarray, asked: np.ndarray, at: np.ndarray) -> list[int]:
    out: list[int] = []
    for i in at:
        if not out or float(f"{given[i]:.6g}") > float(f"{given[out[-1]]:.6g}"):
            out.append(int(i))
    return out


def _commanded(config: Any, effect: Any) -> bool:
    if config.kind == DESCRIBED:
        from rtctl.machines.described_parts import parts_of

        return bool(effect.entry.node == parts_of(config).drive)
    return place(config.kind, effect.entry.node).channel == 0
