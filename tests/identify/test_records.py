"""Records from runs and bundles: equality, and unusable records."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import frf_runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import records
from rtctl.loop import fused
from rtctl.trace.bundle import Bundle


@pytest.fixture(scope="module")
def run() -> fused.Run:
    steps = [{"at": 0.2, "to": 3.0, "ramp": 1.0}, {"at": 3.5, "to": 0.0, "ramp": 1.0}]
    return fused.run(frf_runs.config(reference={"steps": steps}), 8.0)


def bundle(run: fused.Run, **case: Any) -> Bundle:
    columns = {name: run.rows[name] for name in run.rows.dtype.names or ()}
    data = run.loop.machine.config.model_dump(mode="json", exclude_unset=True)
    return Bundle(columns, {"config": data, **case}, Path("there"), {})


def test_run_and_its_bundle_give_the_same_record(run):
    one, two = records.take(run), records.take(bundle(run))
    assert one.config == two.config and one.dt == two.dt == 0.002
    np.testing.assert_array_equal(one.position, two["capstan"])
    assert len(one.t) < len(run.rows)  # rows before state `running` are omitted
    assert [r.source for r in records.take_all([one, bundle(run)])] == ["ivu", "there"]
    assert len(records.take_all(bundle(run))) == 1


def test_steady_intervals_are_exactly_both_legs(run):
    record = records.take(run)
    found = records.steady(record, 0.1)
    assert len(found) == 2
    for stretch, speed in zip(found, (1.0, -1.0), strict=True):
        moved = np.diff(record["ref"][stretch]) / record.dt
        np.testing.assert_allclose(moved, speed, rtol=0.02)
        assert (stretch.stop - stretch.start) * record.dt > 0.9


def test_missing_rows_end_an_interval(run):
    record = records.take(run)
    middle = records.steady(record, 0.1)[0]
    at = (middle.start + middle.stop) // 2
    keep = np.ones(len(record.t), bool)
    keep[at : at + 3] = False
    cut = replace(record, columns={name: np.asarray(c)[keep] for name, c in record.columns.items()})
    assert len(records.steady(cut, 0.0)) == 3


def test_machine_at_rest_has_no_interval(run):
    record = records.take(run)
    still = replace(record, columns={**record.columns, "ref": np.zeros(len(record.t))})
    assert records.steady(still) == []


def test_invalid_column_is_named(run):
    with pytest.raises(UserError, match=r"no column 'capstn'; is it 'capstan'\?"):
        records.take(run)["capstn"]


def test_foreign_bundle_is_refused(run):
    with pytest.raises(UserError, match=r"there/case\.json: no config"):
        records.take(bundle(run, config=None))


def test_record_without_running_rows_is_refused():
    with pytest.raises(NoAnswer, match="the machine never ran"):
        records.take(fused.run(frf_runs.config(), 0.1))


def test_trip_error_names_its_time():
    blocked = frf_runs.config(plant__parameters__tau_F1=1.0, reference={"steps": [{"at": 0.2, "to": 3.0, "ramp": 1.0}]})
    record = records.take(fused.run(blocked, 4.0))
    with pytest.raises(NoAnswer, match=r"tripped, (following_error|encoder_frozen) at \d+\.\d+ s"):
        records.check(record, records.steady(record))


def test_saturation_error_names_its_time(run):
    record = records.take(run)
    found = records.steady(record)
    at = found[0].start + 7
    u1 = record["u1"].copy()
    u1[at] = 10.0 * (1 - 1 / 2048)
    with pytest.raises(NoAnswer, match=rf"the drive saturates, u1 is 10 V at {record.t[at]:.3f} s, 1 samples"):
        records.check(replace(record, columns={**record.columns, "u1": u1}), found)


def test_limit_cycle_between_the_output_limits_is_reported(run):
    record = records.take(run)
    u1 = 9.995 * np.sign(np.sin(0.3 * np.arange(len(record.t))))
    with pytest.raises(NoAnswer, match="an unstable loop oscillates like this"):
        records.check(replace(record, columns={**record.columns, "u1": u1}), records.steady(record))


def test_reversal_error_names_its_time(run):
    record = records.take(run)
    found = records.steady(record)
    speed = record["capstan_speed"].copy()
    speed[found[1].start + 5 : found[1].start + 25] *= -1
    with pytest.raises(NoAnswer, match=rf"reverses for 20 samples from {record.t[found[1].start + 5]:.3f} s"):
        records.check(replace(record, columns={**record.columns, "capstan_speed": speed}), found)


def test_diverging_loop_is_reported(run):
    record = records.take(run)
    found = records.steady(record)
    s = found[0]
    grow = np.zeros(len(record.t))
    k = np.arange(s.stop - s.start)
    grow[s] = 1e-3 * np.exp(6 * k / len(k)) * np.sin(0.3 * k)
    away = replace(record, columns={**record.columns, "capstan": record["capstan"] + grow})
    records.check(record, found)
    with pytest.raises(NoAnswer, match="the loop is not stable"):
        records.check(away, found)
