import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import process_gain

radius = st.floats(0.02, 0.04)


def built(**changes):
    return process_gain.build(process_gain.ProcessGainSettings(**changes), 0.002)


P, RIGID = built(), built(frequency=0.0)


def test_identified_set_gives_the_gain_of_the_thesis_per_ampere():
    assert process_gain.step(P, 0.038, 0.022) / 0.2 == pytest.approx(25.4, rel=0.03)


def test_process_gain_at_zero_frequency_is_that_of_the_rigid_masses():
    m1 = (1.5e-3 + 1.91e-4) / 0.038**2
    m2 = (1.5e-3 + 9.3e-6) / 0.022**2
    wanted = 0.061 * 0.2 / (0.038 * 0.0125 * (m1 + m2 + 5e-6 / 0.0125**2))
    assert process_gain.step(RIGID, 0.038, 0.022) == pytest.approx(wanted, rel=2e-3)


@settings(deadline=None)
@given(radius, radius, st.sampled_from([0.0, 1.0, 10.0]))
def test_process_gain_is_the_frequency_response_of_the_three_masses(R_drive, R_other, f):
    m = [process_gain.mass(P, R_drive), P.m_c, process_gain.mass(P, R_other)]
    w = 2 * np.pi * max(f, 1e-3)
    kappa = 450.0 + 12.5j * w
    coupling = kappa * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1]])
    x = np.linalg.solve(coupling - w * w * np.diag(m), [0.0122 / R_drive, 0.0, 0.0])
    p = {0.0: RIGID, 1.0: P, 10.0: built(frequency=10.0)}[f]
    assert process_gain.step(p, R_drive, R_other) == pytest.approx(w * w * abs(x[1]) / 0.0125, rel=1e-4)


def test_radius_out_of_range_is_clipped():
    assert process_gain.step(P, 0.0, 9.0) == process_gain.step(P, 0.02, 0.04)


def test_empty_radius_range_is_refused():
    with pytest.raises(ValueError, match=r"R_max 0\.02 m is not above R_min 0\.03 m"):
        built(R_min=0.03, R_max=0.02)
