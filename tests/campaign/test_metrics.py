"""Metrics of a run compared with hand calculations."""

from collections.abc import Callable

import numpy as np
import pytest

from rtctl.campaign import cell
from rtctl.campaign.metrics import METRICS, measure
from rtctl.campaign.plan import Plan
from rtctl.loop.fused import Run

Make = Callable[..., Plan]


def test_metrics_of_a_step_of_the_reel_unit(plan: Make) -> None:
    run = cell.play(plan(matrix={}, set={"reference": {"steps": [{"at": 0.1, "to": 1.0}]}}), 0)
    found = measure(run, run.loop.machine)
    assert set(found) == set(METRICS)
    rows = run.rows[run.rows["state"] == 2]
    mm = 12.5  # mm of tape per radian
    after = rows[rows["t"] >= rows["t"][0] + 0.1 - 1e-9]
    tail = after[after["t"] >= after["t"][-1] - 0.1 * (after["t"][-1] - after["t"][0])]
    assert found["final_error_mm"] == pytest.approx(mm * abs(np.mean(tail["target"] - tail["capstan"])))
    assert found["rms_error_mm"] == pytest.approx(mm * np.sqrt(np.mean(rows["capstan_error"] ** 2)))
    assert found["peak_error_mm"] == pytest.approx(mm * np.abs(rows["capstan_error"]).max())
    for name in ("final_error", "rms_error", "peak_error"):  # rad
        assert mm * found[name] == pytest.approx(found[f"{name}_mm"])
    assert found["tension_min_N"] == min(rows["truth_tension1"].min(), rows["truth_tension2"].min())
    assert found["peak_output_V"] == max(np.abs(rows["u1"]).max(), np.abs(rows["u2"]).max())
    assert 0.5 < found["settling_s"] < 1.2 and np.isnan(found["trip_s"])
    assert abs(found["true_final_error_mm"] - found["final_error_mm"]) < 0.02


def test_metrics_without_truth_use_the_estimates(plan: Make) -> None:
    run = cell.play(plan(matrix={}), 0)
    told = [name for name in run.rows.dtype.names or () if not name.startswith("truth_")]
    found = measure(Run(run.rows[told], run.loop), run.loop.machine)
    rows = run.rows[run.rows["state"] == 2]
    assert np.isnan(found["true_final_error_mm"])
    assert found["tension_max_N"] == max(rows["tension1_estimate"].max(), rows["tension2_estimate"].max())


def test_only_the_requested_metrics_are_calculated(plan: Make) -> None:
    made = plan(metrics=["overshoot_pct", "final_error_mm"])
    assert set(cell.run_row(made, 0)) >= {"overshoot_pct", "final_error_mm", "trip", "error"}
    assert "settling_s" not in cell.run_row(made, 0)


def test_step_that_does_not_settle_has_no_settling_time(plan: Make) -> None:
    short = plan(matrix={}, set={"reference": {"steps": [{"at": 0.1, "to": 1.0}]}}, seconds=1.0)
    row = cell.run_row(short, 0)
    assert row["settling_s"] is None and row["final_error_mm"] > 0.5 and row["error"] == ""


def test_run_without_steps_has_no_step_metrics(plan: Make) -> None:
    row = cell.run_row(plan(matrix={}, set={}, seconds=0.8), 0)
    assert row["final_error_mm"] is None and row["rms_error_mm"] is not None
