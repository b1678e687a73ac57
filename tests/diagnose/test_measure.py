import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.case import read_case
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.measure import begin, compare, default_mode, free_run
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator
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
    """`recorded(case)`: what the owner's own model does under its law, and so a recording without any error."""

    def make(case, n=3000):
        read = read_case(case, ".")
        dt = 1 / read.sample_rate
        t = np.arange(n) * dt
        ref = 0.1 * (1 - np.cos(2 * np.pi * t))
        names = {"ivu": ("capstan_counts", "reel1_counts", "reel2_counts")}.get(read.plant, ("x",))
        empty = Record(
            read.plant, read, t, dt, ref, np.zeros(n), np.zeros((n, 1 + (read.plant == "ivu"))),
            dict.fromkeys(names, np.zeros(n)), {},
        )  # fmt: skip
        out, volts, _ = Simulator(empty, lead=0).everything(owner_model(read), CLOSED)
        half = 0.5 if read.plant == "ivu" else 0.0
        return empty._replace(u=volts, y={name: out[:, i] - half for i, name in enumerate(names)})

    return make


def test_the_model_that_made_it_fits_in_both_modes(recorded):
    record = recorded(AXIS)
    model = owner_model(record.case)
    assert default_mode(record) == CLOSED
    closed = compare(record, model)
    assert set(closed.channels) == {"x", "u"}
    assert closed.channels["x"].rmse == 0.0
    assert closed.channels["u"].rmse == 0.0
    free = compare(record, model, OPEN)
    assert set(free.channels) == {"x"}
    assert free.channels["x"].rmse < 1e-12


def test_errors_are_root_mean_squares_in_the_channels_unit(recorded):
    record = recorded(AXIS)
    shifted = record._replace(y={"x": record.y["x"] + np.where(np.arange(len(record.t)) < 500, 0.0, 2e-3)})
    result = compare(shifted, owner_model(record.case), OPEN, skip=500)
    assert result.channels["x"].rmse == pytest.approx(2e-3)
    assert result.channels["x"].nrmse == pytest.approx(2e-3 / np.std(record.y["x"][500:]))
    assert result.as_json()["unit"] == {"x": "m"}


def test_rows_that_are_skipped_do_not_count(recorded):
    record = recorded(AXIS)
    x = record.y["x"].copy()
    x[:20] += 1.0
    result = compare(record._replace(y={"x": x}), owner_model(record.case), CLOSED, skip=20)
    assert result.channels["x"].rmse < 1e-12
    assert result.as_json()["skipped"] == 20
    assert len(result.t) == len(record.t) - 20
    for skip in (-1, len(record.t) - 1):
        with pytest.raises(UserError, match="at least two must be left"):
            compare(record, owner_model(record.case), OPEN, skip)


def test_a_missing_term_shows(recorded):
    record = recorded(AXIS)
    spring = TERMS["load.spring"].settings(term="load.spring", node="carriage", k=300.0)
    assert compare(record, owner_model(record.case).add(spring), OPEN).channels["x"].nrmse > 0.05


def test_reels_are_compared_up_to_a_constant(recorded):
    record = recorded(IVU)
    y = {name: values + (7.0 if name.startswith("reel") else 0.0) for name, values in record.y.items()}
    channels = compare(record._replace(y=y), owner_model(record.case)).channels
    for name in ("reel1_counts", "reel2_counts"):
        reel = channels[name]
        assert reel.rmse < 1.0
        assert np.mean(reel.simulated - reel.recorded) == pytest.approx(0, abs=1e-9)
    assert set(channels) == {"capstan_counts", "reel1_counts", "reel2_counts", "u1", "u2"}
    assert channels["capstan_counts"].unit == "counts"
    assert channels["u1"].unit == "V"


def test_a_model_that_runs_away(recorded):
    record = recorded(AXIS)
    away = TERMS["load.spring"].settings(term="load.spring", node="carriage", k=-1e6)
    with pytest.raises(NoAnswer, match=r"ran away at tick \d+ \(.* s\) in open loop"):
        compare(record, owner_model(record.case).add(away), OPEN)


def test_a_law_that_nobody_knows_closes_no_loop(recorded):
    record = recorded(AXIS)
    case = record.case._replace(controller_known=False)
    record = record._replace(case=case)
    assert default_mode(record) == OPEN
    with pytest.raises(UserError, match="--open-loop"):
        compare(record, owner_model(case), CLOSED)


def test_a_recorded_speed_is_compared_with_a_speed(recorded):
    record = recorded(AXIS)
    speed = np.gradient(record.y["x"], record.dt)
    case = record.case._replace(controller_known=False)
    result = compare(record._replace(y={"speed": speed}, case=case), owner_model(case))
    assert result.channels["speed"].nrmse < 1e-3  # of a difference quotient over two ticks
    assert result.channels["speed"].unit == "m/s"


def test_a_free_run_begins_as_the_recording_does(recorded):
    """In the middle of a motion, at a place and a speed that the record shows."""
    record = recorded(AXIS)
    later = slice(700, None)
    cut = record._replace(
        t=record.t[later], ref=record.ref[later], w=record.w[later], u=record.u[later],
        y={"x": record.y["x"][later]},
    )  # fmt: skip
    model = owner_model(record.case)
    start = begin(Simulator(cut), model)
    assert start[0] == pytest.approx(cut.y["x"][0], abs=1e-9)
    assert start[1] == pytest.approx(np.gradient(record.y["x"], record.dt)[700], rel=1e-3)
    assert compare(cut, model, OPEN).channels["x"].rmse < 1e-6
    at_rest = free_run(Simulator(cut), model, None)[:, 0]
    assert np.sqrt(np.mean((at_rest - cut.y["x"]) ** 2)) > 1e-2


def test_where_it_begins_is_asked_of_an_axis_alone(recorded):
    record = recorded(IVU)
    assert begin(Simulator(record), owner_model(record.case)) is None


def test_a_command_that_was_smooth_is_taken_as_smooth(recorded):
    """An oscillator driven near its resonance: held samples come half a tick late, and the recording tells."""
    case = {**AXIS, "sample_rate": 500.0, "controller": {"kind": "none"},
            "parameters": {"M": 1.0, "F_v": 20.0, "F_c": 0.0, "k": (2 * np.pi * 40) ** 2}}  # fmt: skip
    read = read_case(case, ".")
    t = np.arange(2000) / 500.0
    u = 3.0 * np.sin(2 * np.pi * 37.5 * t)[:, None]
    record = Record("axis", read, t, 2e-3, np.zeros(2000), np.zeros(2000), u, {"x": np.zeros(2000)}, {})
    w, model = 2j * np.pi * 37.5, owner_model(read)
    answer = 3.0 * 35.0 / ((2 * np.pi * 40) ** 2 + 20.0 * w + w**2) * np.exp(w * t)
    smooth = record._replace(y={"x": answer.imag})
    held = record._replace(y={"x": Simulator(record).run(model, OPEN)[:, 0]})
    assert compare(held, model, OPEN).channels["x"].nrmse < 1e-6
    assert compare(smooth, model, OPEN, skip=200).channels["x"].nrmse < 0.03
