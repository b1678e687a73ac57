"""Metrics of a run of a campaign: steps, tracking error, tape tension and drive voltages."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from rtctl.config.units import ANGLES
from rtctl.loop.fused import Run
from rtctl.machines import Machine
from rtctl.tick import safety
from rtctl.trace.metrics import machine_steps


class Metric(NamedTuple):
    words: str
    unit: str
    worse: int  # +1 where more is worse, -1 where less is


METRICS: dict[str, Metric] = {
    "final_error_mm": Metric("largest mean error at the end of a step", "mm", 1),
    "overshoot_pct": Metric("largest overshoot of a step", "%", 1),
    "settling_s": Metric("longest settling time to 2 %; none where a step did not settle", "s", 1),
    "rms_error_mm": Metric("rms of reference - measured while running", "mm", 1),
    "peak_error_mm": Metric("largest of it", "mm", 1),
    "true_final_error_mm": Metric("final error by the emulator's own position", "mm", 1),
    "final_error": Metric("largest mean error at the end of a step, in the machine's unit", "unit", 1),
    "rms_error": Metric("rms of reference - measured while running, in the machine's unit", "unit", 1),
    "peak_error": Metric("largest of it", "unit", 1),
    "tension_min_N": Metric("lowest tape tension while running", "N", -1),
    "tension_max_N": Metric("highest tape tension while running", "N", 1),
    "rms_output_V": Metric("largest rms voltage written to a drive", "V", 1),
    "peak_output_V": Metric("largest voltage written to a drive", "V", 1),
    "trip_s": Metric("controller clock at the trip; none for no trip", "s", -1),
}
TENSIONS = ("truth_tension1", "truth_tension2"), ("tension1_estimate", "tension2_estimate")
NAN = float("nan")


def measure(run: Run, machine: Machine, wanted: Iterable[str] = METRICS) -> dict[str, float]:
    """The `wanted` metrics of a run by name; nan where the machine or this run has none.

    Metrics of steps compare the measured position with the target, as `rtctl run` does. A tripped run has no metrics of
    steps, as its steps did not end.
    """
    rows = run.rows[run.rows["state"] == safety.RUNNING]
    found = dict.fromkeys(METRICS, NAN)
    found["trip_s"] = run.trip_time
    if len(rows) > 1:
        if not run.tripped:
            found |= _steps(rows, machine)
        found |= _error(rows, machine) | _tension(rows) | _outputs(rows, machine)
    return {name: found[name] for name in wanted}


def _steps(rows: np.ndarray, machine: Machine) -> dict[str, float]:
    steps = machine_steps(machine, rows["t"], rows["target"], rows[machine.signals.position])
    if not steps:
        return {}
    settling = [_number(s["settling_s"]) for s in steps]
    if machine.metres_per_unit is None:
        own = _largest(steps, "final_error_rad" if machine.unit in ANGLES else "final_error")
    else:
        own = _largest(steps, "final_error_mm") / (1000.0 * machine.metres_per_unit)
    found = {
        "final_error": own,
        "final_error_mm": _largest(steps, "final_error_mm"),
        "overshoot_pct": _largest(steps, "overshoot_pct"),
        "settling_s": max(settling) if all(x == x for x in settling) else NAN,
    }
    truth = machine.signals.truth
    if truth in (rows.dtype.names or ()):
        true = machine_steps(machine, rows["t"], rows["target"], rows[truth])
        found["true_final_error_mm"] = _largest(true, "final_error_mm")
    return found


def _largest(steps: list[dict[str, float | None]], key: str) -> float:
    return max(abs(_number(s[key])) for s in steps)


def _number(value: float | None) -> float:
    return NAN if value is None else value


def _error(rows: np.ndarray, machine: Machine) -> dict[str, float]:
    error = rows[machine.signals.error]
    rms, peak = float(np.sqrt(np.mean(error * error))), float(np.max(np.abs(error)))
    found = {"rms_error": rms, "peak_error": peak}
    if machine.metres_per_unit is not None:
        mm = 1000.0 * machine.metres_per_unit
        found |= {"rms_error_mm": mm * rms, "peak_error_mm": mm * peak}
    return found


def _tension(rows: np.ndarray) -> dict[str, float]:
    """Metrics of tape tension, from the emulator's true tensions where recorded, else from the estimates."""
    names = rows.dtype.names or ()
    pair = next((pair for pair in TENSIONS if pair[0] in names), None)
    if pair is None:
        return {}
    values = np.concatenate([rows[name] for name in pair])
    return {"tension_min_N": float(values.min()), "tension_max_N": float(values.max())}


def _outputs(rows: np.ndarray, machine: Machine) -> dict[str, float]:
    written = [rows[name] for name in machine.signals.outputs]
    return {
        "rms_output_V": max(float(np.sqrt(np.mean(u * u))) for u in written),
        "peak_output_V": max(float(np.max(np.abs(u))) for u in written),
    }
