"""Step responses: of the reel unit by a radian (8.3), of the linear drive by 1/12 and 1/24 mm (chapter 10).

`rtctl.trace.metrics` has the metrics of a step. This module has the configs of the steps, and statistics of steps.

Source: thesis 8.3, figure 8.6; chapter 10 for the printing steps; 11.1 for 4 um as more than is allowed.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.identify.bench import changed, need
from rtctl.identify.records import Record
from rtctl.machines import module_of
from rtctl.machines.profile import REELS, SCALE
from rtctl.machines.profiles import profile_of
from rtctl.trace.metrics import scales, step_metrics

TWELFTH, TWENTY_FOURTH = 1e-3 / 12, 1e-3 / 24  # m


class Steps(NamedTuple):
    """Steps of a record by one sensor, in time order, and their statistics."""

    each: tuple[dict[str, float | None], ...]  # from step_metrics
    by: str  # evaluated column
    mm: float  # mm per unit of position
    mean_mm: float  # mean final error
    worst_mm: float
    spread_mm: float  # standard deviation of the step sizes, the cause of banding
    overshoot_pct: float  # largest
    settling_s: float | None  # slowest; None where a step did not settle


def printing_config(config: Any, size: float = TWELFTH, count: int = 24, hold: float = 0.4) -> Any:
    """Config with `count` steps of `size` m, `hold` s each, and `count` steps back."""
    need(config.kind, config.name, SCALE)
    ends = [*range(1, count + 1), *range(count - 1, -1, -1)]
    steps = [{"at": 0.5 + k * hold, "to": n * size} for k, n in enumerate(ends)]
    last = {"at": 0.5 + len(ends) * hold, "to": 0.0}
    return changed(config, {"reference": {"steps": [*steps, last]}})


def radian_config(config: Any, tau_C: float = 2.4e-3, R1: float = 0.025, R2: float = 0.035, size: float = 1.0) -> Any:
    """Config of figure 8.6: a jump of -1 rad, a jump of +1 rad 3 s later, friction compensation of `tau_C` Nm.

    As in the thesis, shaper and inertia feedforward are off. The friction of both motors is compensated in full, also
    at standstill.
    """
    need(config.kind, config.name, REELS)
    changes = {
        "law.shaper": {},
        "law.inertia": {},
        "law.friction": {"motor1": {"tau_C": tau_C}, "motor2": {"tau_C": tau_C}, "hand_over": 1.0},
        "radius": {"source": "given", "R1": R1, "R2": R2},
        "plant.parameters.R1": R1,
        "plant.parameters.R2": R2,
        "safety.following_error": 0,
        "reference": {"steps": [{"at": 0.5, "to": -size}, {"at": 3.5, "to": 0.0}, {"at": 6.5, "to": 0.0}]},
    }
    return changed(config, changes)


def steps(record: Record, by: str | None = None) -> Steps:
    """Metrics of all steps of a record by the column `by`: the loop's sensor by default, or `scale`.

    Raises NoAnswer where the reference makes no step.
    """
    machine = record.kind
    by = by or record.signals.position
    mm, rad = scales({"plant": machine, "parameters": {"R_c": radius(record.config)}})
    each = step_metrics(record["t"], record["target"], record[by], mm, rad, settle_floor=record.profile.still)
    if not each:
        raise NoAnswer(f"{record.source}: the reference makes no step")
    assert mm is not None  # ivu and ldu move along a line
    return summary(each, by, mm)


def summary(each: Sequence[dict[str, float | None]], by: str, mm: float) -> Steps:
    """Statistics of several steps."""
    errors = np.array([step["final_error_mm"] for step in each], float)
    settling = [step["settling_s"] for step in each]
    return Steps(
        each=tuple(each),
        by=by,
        mm=mm,
        mean_mm=float(errors.mean()),
        worst_mm=float(errors[np.argmax(np.abs(errors))]),
        spread_mm=float(np.diff(errors, prepend=0.0).std()),
        overshoot_pct=max(float(step["overshoot_pct"] or 0.0) for step in each),
        settling_s=None if None in settling else max(float(s) for s in settling if s is not None),
    )


def radius(config: Any) -> float | None:
    """Capstan radius in m, the factor from rad to m; None for an axis."""
    return float(module_of(config.kind).radius(config)) if profile_of(config.kind).encoder else None


def usual_configs(config: Any) -> list[Any]:
    """Configs of the thesis: 1/12 and 1/24 mm on a linear drive, figure 8.6 (a) and (b) on a reel unit.

    Raises UserError for another machine.
    """
    need(config.kind, config.name, REELS, SCALE)
    if profile_of(config.kind).has(SCALE):
        return [printing_config(config, TWELFTH), printing_config(config, TWENTY_FOURTH)]
    return [radian_config(config, 2.4e-3), radian_config(config, 1.5e-3)]


def size_mm(one: Steps) -> float:
    """Size of the steps of a record in mm, from the first step."""
    return abs(float(one.each[0]["size"] or 0.0)) * one.mm
