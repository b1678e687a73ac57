import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.trace.metrics import final_error_unit, scales, step_metrics
from rtctl.trace.plot import summary

DT = 0.002
KEYS = ["t", "size", "final_error_rad", "final_error_mm", "overshoot_pct", "settling_s"]


def held(*values: float, each: int = 500) -> np.ndarray:
    return np.repeat(values, each).astype(float)


def clock(ref: np.ndarray) -> np.ndarray:
    return np.arange(len(ref)) * DT


def test_first_order_response_has_the_analytic_metrics():
    ref = held(0.0, 2.0, each=1000)
    t = clock(ref)
    tau = 0.1
    y = np.where(t < 2.0, 0.0, 2.0 * (1 - np.exp(-(t - 2.0) / tau)))
    (step,) = step_metrics(t, ref, y, 12.5)
    assert list(step) == KEYS
    assert (step["t"], step["size"]) == (2.0, 2.0)
    assert step["overshoot_pct"] == 0.0
    assert step["settling_s"] == pytest.approx(tau * np.log(50), abs=DT)
    assert abs(step["final_error_rad"]) < 1e-7


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("zeta", [0.3, 0.6])
def test_overshoot_agrees_with_the_damping(sign, zeta):
    ref = sign * held(1.0, 3.0, each=2000)
    t = clock(ref)
    wn, s = 20.0, np.maximum(t - t[2000], 0)
    wd = wn * np.sqrt(1 - zeta**2)
    y = sign * (3 - 2 * np.exp(-zeta * wn * s) * (np.cos(wd * s) + zeta * wn / wd * np.sin(wd * s)))
    (step,) = step_metrics(t, ref, y, 1.0)
    assert step["overshoot_pct"] == pytest.approx(100 * np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-3)


def test_final_error_is_the_signed_mean_of_the_last_tenth():
    ref = held(0.0, 1.0, -1.0)
    y = ref.copy()
    y[500:940] -= 0.5
    y[950:1000] -= 0.01
    y[1450:1500] -= 0.02
    up, down = step_metrics(clock(ref), ref, y, scale_mm=12.5)
    assert up["final_error_rad"] == pytest.approx(0.01) and up["final_error_mm"] == pytest.approx(0.125)
    assert down["final_error_rad"] == pytest.approx(0.02) and down["size"] == -2.0
    assert up["settling_s"] == pytest.approx(440 * DT)


def test_settling_time_of_an_unsettled_step_is_none():
    ref = held(0.0, 1.0)
    y = ref - 0.03
    assert step_metrics(clock(ref), ref, y, 1.0)[0]["settling_s"] is None
    assert step_metrics(clock(ref), ref, y, 1.0, settle_floor=0.031)[0]["settling_s"] == 0.0
    assert step_metrics(clock(ref), ref, y, 1.0, settle_band=0.031)[0]["settling_s"] == 0.0
    y[-1] = np.nan
    assert step_metrics(clock(ref), ref, y, 1.0, settle_band=1.0)[0]["settling_s"] is None


@pytest.mark.parametrize("length", [2, 7, 60])
def test_ramp_is_one_step_at_its_end(length):
    ramp = np.linspace(0.0, 0.1, length + 1)[1:]
    ref = np.concatenate([np.zeros(100), ramp, np.full(200, 0.1), np.full(200, 0.3)])
    t = clock(ref)
    first, second = step_metrics(t, ref, ref, 1000.0, 80.0)
    assert first["t"] == t[100 + length - 1] and first["size"] == pytest.approx(0.1)
    assert second["t"] == t[300 + length] and second["size"] == pytest.approx(0.2)


@pytest.mark.parametrize(
    "ref",
    [
        np.zeros(100),
        np.sin(np.linspace(0, 30, 5000)),
        np.array([]),
        np.array([1.0]),
        np.concatenate([np.zeros(50), [1.0], np.zeros(50)]),  # a pulse of one sample
        np.concatenate([np.zeros(50), np.linspace(0, 1, 50)]),  # a ramp that does not end
        0.1 + 1e-17 * np.arange(100),
    ],
)
def test_reference_without_steps_has_no_metrics(ref):
    assert step_metrics(clock(ref), ref, ref, 1.0) == []


@settings(deadline=None)
@given(
    holds=st.lists(st.tuples(st.integers(-50, 50), st.integers(10, 60), st.integers(1, 20)), min_size=1, max_size=6),
    error=st.floats(-1, 1),
)
def test_every_step_is_found_with_its_size_and_error(holds, error):
    values, sizes, last = [0.0] * 20, [], 0
    for value, length, ramp in holds:
        values += [*np.linspace(last, value, ramp + 1)[1:-1], *[value] * length]
        sizes += [value - last] if value != last else []
        last = value
    ref = np.array(values, dtype=float)
    steps = step_metrics(clock(ref), ref, ref - error, 12.5, None)
    assert [step["size"] for step in steps] == pytest.approx(sizes)
    for step in steps:
        assert step["final_error_rad"] is None and step["final_error_mm"] == pytest.approx(12.5 * error)
        assert step["overshoot_pct"] >= 0.0
        assert step["overshoot_pct"] == pytest.approx(max(0.0, -error / step["size"]) * 100, abs=1e-9)


def test_final_error_is_in_radians_and_millimetres_on_both_machines():
    ref = held(0.0, 1.0)
    ivu = scales({"plant": "ivu", "parameters": {"R_c": 0.0125}})
    ldu = scales({"plant": "ldu", "parameters": {"R_c": 0.0125}})
    (rad,) = step_metrics(clock(ref), ref, ref - 0.01, *ivu)
    (metre,) = step_metrics(clock(ref), ref * 0.0125, (ref - 0.01) * 0.0125, *ldu)
    for key in ("final_error_rad", "final_error_mm"):
        assert rad[key] == pytest.approx(metre[key])
    assert rad["final_error_mm"] == pytest.approx(0.125)
    assert scales({"plant": "axis"}) == (1000.0, None)
    with pytest.raises(ValueError, match="R_c is missing"):
        scales({"plant": "ivu"})


def test_error_of_a_rotary_axis_is_an_angle():
    ref = held(0.0, 1.0)
    (step,) = step_metrics(clock(ref), ref, ref - 0.01, *scales({"plant": "axis", "sensors": {"unit": "rad"}}))
    assert step["final_error_mm"] is None and step["final_error_rad"] == pytest.approx(0.01)
    assert final_error_unit([step]) == "rad" and summary([step]).startswith("1 step   |   largest final error 0.01 rad")


def test_columns_of_different_length_are_refused():
    with pytest.raises(ValueError, match="equally long"):
        step_metrics(np.zeros(3), np.zeros(3), np.zeros(2), 1.0)
