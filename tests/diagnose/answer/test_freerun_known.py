"""Free runs of machines of exchange format 1 against recordings simulated with the nominal model."""

import numpy as np
import pytest
from known_records import at_rest, closed, driven, of_closed

from rtctl.case.format1 import read_case
from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.answer import freerun
from rtctl.diagnose.answer.believe import check_believed
from rtctl.diagnose.answer.freerun import begin
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.plants.physics import TERMS

AXIS = {
    "plant": "axis",
    "sample_rate": 1000.0,
    "parameters": {"M": 95.0, "F_v": 200.0, "F_c": 20.0},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
}
IVU = {
    "plant": "ivu",
    "sample_rate": 500.0,
    "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
    "drive": {"amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12},
    "controller": {"kind": "pd", "P": 6.2, "D": 1.0, "derivative_filter_hz": 80.0, "tension_N": 0.1},
}


@pytest.fixture(scope="module")
def recorded():
    """`recorded(case)`: simulation of the nominal model under its law, a recording without model error."""

    def make(case, n=3000):
        read = read_case(case, ".")
        ref = 0.1 * (1 - np.cos(2 * np.pi * np.arange(n) / read.sample_rate))
        return of_closed(at_rest(read, n, ref), owner_model(read))

    return make


def compare(record, *terms, closed=None, skip=0):
    """Comparison of a record with the nominal model and the given terms."""
    return freerun.compare(graph_record(record, owner_model(record.case).add(*terms)), closed, skip)


def spring(k):
    return TERMS["load.spring"].settings(term="load.spring", node="carriage", k=k)


def test_true_model_fits_in_closed_and_open_loop(recorded):
    record = recorded(AXIS)
    by_law = compare(record)
    assert by_law.closed and set(by_law.channels) == {"x", "u"}
    assert max(channel.nrmse for channel in by_law.channels.values()) < 1e-6
    free = compare(record, closed=False)
    assert not free.closed and set(free.channels) == {"x"}
    assert free.channels["x"].rmse < 1e-9


def test_free_run_error_is_the_rms_in_the_unit_of_the_channel(recorded):
    record = recorded(AXIS)
    shifted = record._replace(y={"x": record.y["x"] + np.where(np.arange(len(record.t)) < 500, 0.0, 2e-3)})
    result = compare(shifted, closed=False, skip=500)
    assert result.channels["x"].rmse == pytest.approx(2e-3, rel=1e-4)
    assert result.channels["x"].nrmse == pytest.approx(2e-3 / np.std(record.y["x"][500:]), rel=1e-4)
    assert result.as_json()["unit"] == {"x": "m"}


def test_skipped_rows_do_not_count(recorded):
    record = recorded(AXIS)
    result = compare(record, closed=True, skip=20)
    assert result.as_json()["skipped"] == 20
    assert len(result.t) == len(record.t) - 20
    for skip in (-1, len(record.t) - 1):
        with pytest.raises(UserError, match="leave at least two"):
            compare(record, closed=False, skip=skip)


def test_wrong_term_raises_the_free_run_error(recorded):
    assert compare(recorded(AXIS), spring(300.0), closed=False).channels["x"].nrmse > 0.05


def test_reel_counters_are_compared_up_to_a_constant(recorded):
    record = recorded(IVU)
    y = {name: values + (7.0 if name.startswith("reel") else 0.0) for name, values in record.y.items()}
    channels = compare(record._replace(y=y)).channels
    for name in ("reel1_counts", "reel2_counts"):
        reel = channels[name]
        assert reel.rmse < 1.0
        assert np.mean(reel.simulated - reel.recorded) == pytest.approx(0, abs=1e-9)
    assert set(channels) == {"capstan_counts", "reel1_counts", "reel2_counts", "u1", "u2"}
    assert channels["capstan_counts"].unit == "counts"
    assert channels["u1"].unit == "V"


def test_divergent_model_has_no_answer(recorded):
    with pytest.raises(NoAnswer, match=r"diverged at tick \d+ \(.* s\) in open loop"):
        compare(recorded(AXIS), spring(-1e6), closed=False)


def test_unknown_law_allows_only_an_open_loop(recorded):
    record = recorded(AXIS)
    record = record._replace(case=record.case._replace(controller_known=False))
    assert not compare(record).closed
    with pytest.raises(UserError, match="--open-loop"):
        compare(record, closed=True)


def test_recorded_speed_is_compared_with_the_simulated_speed(recorded):
    record = recorded(AXIS)
    speed = np.gradient(record.y["x"], record.dt)
    result = compare(record._replace(y={"speed": speed}, case=record.case._replace(controller_known=False)))
    assert result.channels["speed"].nrmse < 1e-3  # error of a central difference over two ticks
    assert result.channels["speed"].unit == "m/s"


def cut(record, rows):
    """The given rows of a record."""
    arrays = {name: getattr(record, name)[rows] for name in ("t", "ref", "w", "u")}
    return record._replace(y={name: values[rows] for name, values in record.y.items()}, **arrays)


def test_free_run_begins_with_the_recorded_position_and_speed(recorded):
    """The record starts in the middle of a motion."""
    record = recorded(AXIS)
    later = cut(record, slice(700, None))
    made = graph_record(later)
    position, speed = begin(Simulator(made), nominal(made.case))
    assert position == pytest.approx(later.y["x"][0], abs=1e-9)
    assert speed == pytest.approx(np.gradient(record.y["x"], record.dt)[700], rel=1e-3)
    assert compare(later, closed=False).channels["x"].rmse < 1e-6


def test_free_run_of_a_speed_sensor_begins_with_the_recorded_speed():
    case = read_case(
        {"plant": "axis", "sample_rate": 50.0, "parameters": {"M": 1.0, "F_v": 2.0}, "controller": {"kind": "unknown"},
         "drive": {"newton_per_volt": 4.0}}, "."
    )  # fmt: skip
    u = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], 100), 5)[:, None]
    empty = at_rest(case, len(u), u=u, sensors=("speed",))
    whole = empty._replace(y=driven(empty, owner_model(case)))
    k = int(np.flatnonzero((whole.y["speed"] < -0.5) & (np.arange(len(u)) > 50))[0])
    result = compare(cut(whole, slice(k, None)), skip=20)
    assert result.channels["speed"].rmse < 2e-3
    assert result.as_json()["unit"] == {"speed": "m/s"}


def test_smooth_command_is_not_treated_as_held():
    """Oscillator driven near its resonance: a held command is half a tick late, which the recording shows."""
    case = {**AXIS, "sample_rate": 500.0, "controller": {"kind": "none"},
            "parameters": {"M": 1.0, "F_v": 20.0, "F_c": 0.0, "k": (2 * np.pi * 40) ** 2}}  # fmt: skip
    read = read_case(case, ".")
    t = np.arange(2000) / 500.0
    record = at_rest(read, 2000, u=3.0 * np.sin(2 * np.pi * 37.5 * t)[:, None])
    w = 2j * np.pi * 37.5
    answer = 3.0 * 35.0 / ((2 * np.pi * 40) ** 2 + 20.0 * w + w**2) * np.exp(w * t)
    held = record._replace(y=driven(record, owner_model(read)))
    assert compare(held, closed=False).channels["x"].nrmse < 1e-6
    assert compare(record._replace(y={"x": answer.imag}), closed=False, skip=200).channels["x"].nrmse < 0.03


def test_machine_at_rest_begins_its_free_run_at_rest(recorded):
    record = recorded(IVU)
    n = 200  # rows at rest
    ref = np.concatenate([np.zeros(n), record.ref])
    made = at_rest(record.case, n + len(record.t), ref)
    y, u = closed(made, owner_model(record.case))
    y = {name: np.floor(values + 0.5) for name, values in y.items()}
    assert compare(made._replace(y=y, u=u), closed=False).skipped == 0
    later = compare(cut(made._replace(y=y, u=u), slice(n + 100, None)), closed=False)
    assert later.skipped > 0


def test_missing_mass_is_reported():
    case = read_case({**AXIS, "parameters": {}}, ".")
    wave = np.sin(np.arange(2000.0))
    record = at_rest(case, 2000, u=wave[:, None])._replace(y={"x": np.cos(np.arange(2000.0))})
    with pytest.raises(UserError, match=r"parameters\.M is missing"):
        check_believed(graph_record(record))
