"""Driver curve: (12.3) for the measured amplifier, a straight line for the linear one, refused while turning."""

import bench_runs as runs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import driver_curve as dc


def test_curve_of_the_measured_amplifier():
    """12.2: 4.2e-2 A below 0.8 V, which is 8.8e-4 Nm; 0.262 A at 3 V by its equation."""
    curve = dc.driver_curve(runs.played(dc.driver_config, "ldu_printer"))
    assert len(curve.levels) == 31
    assert curve.I_0 == pytest.approx(4.2e-2, rel=1e-3)
    assert curve.torque == pytest.approx(8.8e-4, rel=0.01)
    assert curve.V_k == pytest.approx(0.8, abs=2e-3)
    assert curve.gain == pytest.approx(0.1, rel=1e-3)
    assert curve.at_3 == pytest.approx(0.262, abs=1e-3)


@settings(deadline=None, max_examples=50)
@given(I_0=st.floats(0.01, 0.1), V_k=st.floats(0.4, 2.0), gain=st.floats(0.05, 0.5), seed=st.integers(0, 99))
def test_curve_is_fitted_through_noise(I_0, V_k, gain, seed):
    V = np.arange(31) * 0.1
    noise = 1e-4 * np.random.default_rng(seed).standard_normal(31)
    amperes = I_0 + gain * np.maximum(V - V_k, 0) + noise
    curve = dc.fit(tuple(dc.Level(v, a, 0.0, 7500) for v, a in zip(V.tolist(), amperes.tolist(), strict=True)))
    assert curve.gain == pytest.approx(gain, abs=4e-4)
    assert curve.I_0 == pytest.approx(I_0, abs=2e-3)
    assert curve.V_k == pytest.approx(V_k, abs=0.03)


def test_linear_curve_has_no_knee():
    curve = dc.fit(tuple(dc.Level(0.1 * k, 0.01 * k, 0.0, 7500) for k in range(31)))
    assert (curve.I_0, curve.V_k) == (0.0, 0.0)
    assert curve.at_3 == pytest.approx(0.3)


def test_turning_motor_is_refused():
    n = 20_000
    columns = {"u": np.repeat([0.5, 1.0], n // 2), "truth_current": np.full(n, 0.05), "encoder_counts": np.arange(n)}
    with pytest.raises(NoAnswer, match=r"the motor turns from 0\.00 s on"):
        dc.driver_curve(runs.made("ldu", columns, 1e-4))
    with pytest.raises(NoAnswer, match="2 voltages held"):
        dc.driver_curve(runs.made("ldu", columns | {"encoder_counts": np.zeros(n)}, 1e-4))
    del columns["truth_current"]
    with pytest.raises(UserError, match="no column 'current'"):
        dc.driver_curve(runs.made("ldu", columns, 1e-4))


def test_experiment_stays_below_the_runaway_voltage():
    with pytest.raises(UserError, match=r"runs away above 3\.0 V"):
        dc.driver_config(runs.config("ldu_printer"), 3.5)
