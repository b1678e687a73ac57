from pathlib import Path

import numpy as np
import pytest
from graph_cases import BELT, PENDULUM, RATE, case_of, write_bundle

from rtctl.case.format2 import read_case
from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.answer.load import load
from rtctl.diagnose.model.recording import record_of

N = 200
COUNTS = np.round(3000 * np.sin(np.arange(N) / 20))
COLUMNS = {"t": np.arange(N) / RATE, "u": np.sin(np.arange(N) / 9), "rod_counts": COUNTS}


def record_from(columns, case=None):
    return record_of(columns, read_case(case or case_of(PENDULUM), "bench"), Path("bench/recording.parquet"))


def test_bundle_is_read_in_si_units(tmp_path):
    record = load(write_bundle(tmp_path / "bench", case_of(PENDULUM), COLUMNS))
    assert record.dt == 1 / RATE
    assert record.u.shape == (N, 1)
    np.testing.assert_allclose(record.y["encoder"], (COUNTS + 0.5) / 5000.0)  # the middle of a count
    assert record.grain["encoder"] == 1 / 5000.0
    assert record.main == "encoder"


def test_wrapping_counter_is_unwrapped():
    way = np.round(np.linspace(0, 100_000, N))
    record = record_from({**COLUMNS, "rod_counts": (way + 32768) % 65536 - 32768})
    np.testing.assert_allclose(np.diff(record.y["encoder"]), np.diff(way) / 5000.0)


def test_secondary_sensor_may_be_absent():
    record = record_from({"t": COLUMNS["t"], "u": COLUMNS["u"], "encoder_counts": COUNTS}, case_of(BELT))
    assert list(record.y) == ["encoder"]


def test_uneven_times_are_resampled_to_an_even_clock():
    t = COLUMNS["t"] + 2e-4 * np.sin(np.arange(N))
    record = record_from({**COLUMNS, "t": t}, case_of(PENDULUM) | {"sample_rate": None})
    np.testing.assert_allclose(np.diff(record.t), record.dt)
    np.testing.assert_allclose(record.u[:, 0], np.interp(record.t, t, COLUMNS["u"]))


def test_measured_inputs_act_on_their_body():
    case = case_of(PENDULUM, inputs={"wind": {"body": "rod", "column": "load", "per_unit": 10.0}})
    record = record_from({**COLUMNS, "load": np.full(N, 5.0)}, case)
    np.testing.assert_allclose(record.forces, 0.5)


@pytest.mark.parametrize(
    ("change", "kind", "sentence"),
    [
        ({"u": None, "uu": COLUMNS["u"]}, UserError, "no column 'u' (V, command); is it 'uu'?"),
        ({"rod_counts": None}, UserError, "no column 'rod_counts' (sensor encoder)"),
        ({"rod_counts": COUNTS + 0.3}, UserError, "column 'rod_counts', row 0: 0.3 is not a whole number"),
        ({"u": np.where(np.arange(N) == 7, np.nan, 1.0)}, UserError, "column 'u', row 7: nan; it should be a finite"),
        ({"u": np.zeros(N)}, NoAnswer, "'u' never changes; the machine was not driven"),
        ({"rod_counts": np.zeros(N)}, NoAnswer, "column 'rod_counts' never changes; nothing moved"),
        ({"t": np.arange(N) / 400.0}, UserError, "sample_rate in case.json is 500 Hz"),
    ],
)
def test_invalid_columns_are_refused(change, kind, sentence):
    columns = {name: values for name, values in {**COLUMNS, **change}.items() if values is not None}
    with pytest.raises(kind) as error:
        record_from(columns)
    assert sentence in str(error.value)


def test_too_few_rows_have_no_answer():
    case = case_of(PENDULUM)
    least = len(read_case(case, "bench").fitted) + 10
    with pytest.raises(
        NoAnswer, match=f"holds {least - 1} rows; {least - 10} unknown numbers and the noise need {least}"
    ):
        record_from({name: values[: least - 1] for name, values in COLUMNS.items()}, case)


def test_drive_acts_only_while_enabled():
    case = case_of(PENDULUM)
    motor = {**PENDULUM["drives"]["motor"], "enabled": "torque_on"}
    case["machine"] = {**PENDULUM, "drives": {"motor": motor}}
    on = np.where(np.arange(N) < 120, 1.0, 0.0)
    np.testing.assert_array_equal(record_from({**COLUMNS, "torque_on": on}, case).u[:, 0], COLUMNS["u"] * on)
    with pytest.raises(UserError, match=r"column 'torque_on', row 120: 0\.5; it should be 0"):
        record_from({**COLUMNS, "torque_on": np.where(on > 0, 1.0, 0.5)}, case)


def test_sensors_without_direction_alone_are_refused():
    case = case_of(PENDULUM)
    blind = {**PENDULUM["sensors"]["encoder"], "direction": False}
    case["machine"] = {**PENDULUM, "sensors": {"encoder": blind}}
    with pytest.raises(NoAnswer, match="no sensor tells a direction"):
        record_from(COLUMNS, case)


def test_sensor_behind_a_tape_is_not_the_main_sensor():
    machine = {
        "bodies": {"reel": {"inertia": 1e-4, "radius": 0.03}, "capstan": {"inertia": 1e-4, "radius": 0.0125}},
        "joints": {
            "path": {"from": "capstan", "to": "reel", "span": "open", "stiffness": 450.0, "damping": 12.5},
            "motor": {"from": "frame", "to": "capstan", "stiffness": 10.0, "damping": 0.1},
        },
        "drives": {"motor": {"body": "capstan", "column": "u", "kind": "force", "gain": 10.0}},
        "sensors": {
            "camera": {"body": "capstan", "through": "path", "column": "image", "resolution": 1e-5, "per_unit": 0.0125},
            "counter": {"body": "capstan", "column": "counts", "counts_per_unit": 1000.0},
        },
    }  # fmt: skip
    columns = {**COLUMNS, "image": 1e-5 * COUNTS, "counts": COUNTS}
    assert record_from(columns, case_of(machine)).main == "counter"
