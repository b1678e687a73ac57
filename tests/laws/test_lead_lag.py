import numpy as np
import pytest
from pydantic import ValidationError

from rtctl.laws import lead_lag

DT = 1e-4
SETTINGS = {"k": 1.7e5, "alpha": 0.05, "tau_I": 2.22, "beta": 10.0, "tau_D": 3.5e-3}


@pytest.mark.parametrize("f", [0.01, 1.0, 20.0, 52.0, 200.0])
def test_lead_lag_matches_the_continuous_filter(response, f):
    s = 2j * np.pi * f
    wanted = 1.7e5 * (0.111 * s + 1) / (2.22 * s + 1) * (0.035 * s + 1) / (3.5e-3 * s + 1)
    p = lead_lag.build(lead_lag.LeadLagSettings(**SETTINGS), DT)
    assert response(p, f, DT) == pytest.approx(wanted, rel=2e-3)


def test_lead_lag_dc_gain_is_k(response):
    p = lead_lag.build(lead_lag.LeadLagSettings(**SETTINGS), DT)
    assert abs(response(p, 0.0, DT)) == pytest.approx(1.7e5, rel=1e-6)


def test_reset_lead_lag_is_in_steady_state(zero):
    p = lead_lag.build(lead_lag.LeadLagSettings(**SETTINGS), DT)
    s = zero(lead_lag.BIQUAD_STATE)
    y = lead_lag.reset(p, s, 1e-6)
    assert lead_lag.step(p, s, 1e-6) == pytest.approx(y, rel=1e-6)


@pytest.mark.parametrize("bad", [{"alpha": 1.0}, {"beta": 1.0}, {"tau_I": 0.0}, {"tau_D": -1.0}])
def test_invalid_lead_lag_parameters_are_refused(bad):
    with pytest.raises(ValidationError):
        lead_lag.LeadLagSettings(**{**SETTINGS, **bad})


def test_overlapping_or_too_fast_corners_are_refused():
    with pytest.raises(ValueError, match="make alpha tau_I larger"):
        lead_lag.build(lead_lag.LeadLagSettings(**{**SETTINGS, "tau_I": 0.1}), DT)
    with pytest.raises(ValueError, match="not below half the sample rate"):
        lead_lag.build(lead_lag.LeadLagSettings(**{**SETTINGS, "tau_D": 1e-5}), DT)
