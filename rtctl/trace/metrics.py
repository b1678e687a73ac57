"""Metrics of a step response: final error, overshoot, settling time."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from rtctl.config.units import ANGLES
from rtctl.machines import MODULES, Machine
from rtctl.machines.profiles import profile_of

LEAST_HOLD = 10  # samples: shortest rest of the reference that ends a step


def step_metrics(
    t: np.ndarray,
    ref: np.ndarray,
    y: np.ndarray,
    scale_mm: float | None,
    rad_per_unit: float | None = 1.0,
    settle_band: float = 0.02,
    settle_floor: float = 0.0,
) -> list[dict[str, float | None]]:
    """Step metrics, one dict for each step of the reference `ref` (a jump or a ramp), from `y` until the next step.

    `t` in s; reference `ref` and measured `y` in the machine's unit. One unit is `scale_mm` mm and `rad_per_unit` rad;
    `scales` returns both for a case. The keys:

    - `t`: s, when the reference arrives at its new value; `size`: in the machine's unit, with its sign
    - `final_error_rad`, `final_error_mm`: mean of ref - y over the last tenth of the hold; None without a scale to
      rad or mm (an angle that moves no tape has no mm)
    - `final_error`: mean of ref - y in the machine's unit, where that unit is neither an angle nor a length
    - `overshoot_pct`: how far y went beyond the new value, in % of the step; never negative
    - `settling_s`: from `t` until y stays within `settle_band` (share of the step) or `settle_floor` (machine's unit; a
      few sensor counts), the larger of both; None where y does not settle before the next step

    Raises ValueError where the lengths differ.
    """
    t, ref, y = (np.asarray(v, dtype=float) for v in (t, ref, y))
    if not t.shape == ref.shape == y.shape or t.ndim != 1:
        raise ValueError(f"t, ref and y should be equally long: they are {t.shape}, {ref.shape} and {y.shape}")
    resolution = 1e-9 * float(np.ptp(ref)) if len(ref) else 0.0
    steps: list[dict[str, float | None]] = []
    for (_, before), (start, end) in pairwise(_holds(ref, resolution)):
        size = float(ref[start] - ref[before - 1])
        if abs(size) <= resolution:
            continue  # the reference returned without a rest
        hold = slice(start, end)
        final = _final_error(t[hold], ref[hold] - y[hold])
        steps.append(
            {
                "t": float(t[start]),
                "size": size,
                **({"final_error": final} if scale_mm is None and rad_per_unit is None else {}),
                "final_error_rad": None if rad_per_unit is None else final * rad_per_unit,
                "final_error_mm": None if scale_mm is None else final * scale_mm,
                "overshoot_pct": max(0.0, float(np.max((y[hold] - ref[hold]) / size)) * 100),
                "settling_s": _settling(t[hold], ref[hold] - y[hold], max(settle_band * abs(size), settle_floor)),
            }
        )
    return steps


def machine_steps(machine: Machine, t: np.ndarray, ref: np.ndarray, y: np.ndarray) -> list[dict[str, float | None]]:
    """`step_metrics` with the scales and the settling limits of a machine."""
    rad = 1.0 if machine.unit in ANGLES else 1.0 / machine.radius if machine.radius else None
    mm = None if machine.metres_per_unit is None else 1000.0 * machine.metres_per_unit
    return step_metrics(t, ref, y, mm, rad, settle_floor=settle_floor(machine.kind))


def settle_floor(kind: str) -> float:
    """Error in the machine's unit below which a machine of this kind has settled; 0 for an unknown kind."""
    return MODULES[kind].SETTLE_FLOOR if kind in MODULES else 0.0


def final_error_unit(steps: Sequence[Mapping[str, Any]]) -> str:
    """Display unit of the final errors: mm; rad where nothing moves along a line; "" (machine's unit) for a speed."""
    for unit in ("mm", "rad"):
        if not steps or any(step.get(f"final_error_{unit}") is not None for step in steps):
            return unit
    return ""


def final_error_key(unit: str) -> str:
    """Key of the final error for a unit from `final_error_unit`."""
    return f"final_error_{unit}" if unit else "final_error"


def scales(case: Mapping[str, Any]) -> tuple[float | None, float | None]:
    """mm and rad per unit of position. The unit is rad of the capstan on an ivu, m on an ldu or another linear axis.

    mm is None on a rotary axis. rad is None on a linear axis without capstan radius R_c. Raises ValueError for an ivu
    without R_c.
    """
    unit = (case.get("loop") or case.get("sensors") or {}).get("unit")
    if unit in ANGLES:
        return None, 1.0
    if unit not in (None, "m"):  # a speed
        return None, None
    radius = case.get("parameters", {}).get("R_c")
    if profile_of(str(case.get("plant"))).unit in ANGLES:
        if not radius:
            raise ValueError("parameters.R_c is missing: without the capstan's radius (m) rad are not mm")
        return 1000.0 * radius, 1.0
    return 1000.0, 1.0 / radius if radius else None


def _holds(ref: np.ndarray, resolution: float) -> list[tuple[int, int]]:
    """Intervals [start, end) of rows in which the reference rests."""
    if not len(ref):
        return []
    moves = np.flatnonzero(np.abs(np.diff(ref)) > resolution) + 1  # first sample at a new value
    starts, ends = np.concatenate(([0], moves)), np.concatenate((moves, [len(ref)]))
    long = ends - starts >= LEAST_HOLD
    long[0] = True  # a step may follow the first sample
    return list(zip(starts[long].tolist(), ends[long].tolist(), strict=True))


def _final_error(t: np.ndarray, error: np.ndarray) -> float:
    return float(error[t >= t[-1] - 0.1 * (t[-1] - t[0])].mean())


def _settling(t: np.ndarray, error: np.ndarray, band: float) -> float | None:
    outside = np.flatnonzero(~(np.abs(error) <= band))
    if not len(outside):
        return 0.0
    if outside[-1] == len(t) - 1:
        return None
    return float(t[outside[-1] + 1] - t[0])
