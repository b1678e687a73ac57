import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.design import mechanics


def test_optimal_radii_are_those_of_the_thesis():
    """12.4: 4 dB at 6.2 and 23 mm; the optimum is flat."""
    p = mechanics.named()
    best = mechanics.optimum(p)
    assert 4.0 <= mechanics.gain(p, 6.2e-3, 23e-3) <= best.gain <= 4.6
    assert best.R_c == pytest.approx(5.7e-3, rel=0.02)
    assert best.R_t == pytest.approx(19.2e-3, rel=0.02)


@settings(deadline=None, max_examples=50)
@given(st.floats(2e-3, 12e-3), st.floats(8e-3, 60e-3))
def test_no_radii_are_better_than_the_optimum(R_c, R_t):
    p = mechanics.named()
    assert mechanics.gain(p, R_c, R_t) <= mechanics.optimum(p).gain + 1e-9


def test_slip_limits_are_those_of_the_thesis():
    """12.5: 14 mNm, 2.5 mNm, 125 N and 46 N."""
    assert mechanics.slip_torque(mechanics.MOTOR_FORCE, 1.5e-3) == pytest.approx(14e-3, rel=0.05)
    assert mechanics.slip_torque(mechanics.STRIP_FORCE, 3e-3, 20) == pytest.approx(2.5e-3, rel=0.05)
    assert mechanics.normal_force(mechanics.MOTOR_TORQUE, 20, 3e-3) == pytest.approx(125, rel=0.01)
    assert mechanics.normal_force(mechanics.MOTOR_TORQUE, 23 / 1.5, 6.2e-3) == pytest.approx(46, rel=0.02)


def test_force_and_torque_conversions_are_inverse():
    assert mechanics.slip_torque(mechanics.normal_force(7e-3, 20, 3e-3), 3e-3, 20) == pytest.approx(7e-3)


@pytest.mark.parametrize(("name", "resonances", "zero"), [
    ("figure_12_2", (114, 287, 2100), 254), ("appendix_f", (239, 951, 3261), 919),
])  # fmt: skip
def test_modes_of_both_parameter_sets(name, resonances, zero):
    """Figure 12.2, and what the listed stiffnesses give."""
    found = mechanics.modes(mechanics.named(name))
    np.testing.assert_allclose(found.resonances, resonances, rtol=0.02)
    np.testing.assert_allclose(found.anti_resonances, [zero], rtol=0.01)
    assert not len(mechanics.modes(mechanics.named(name), "encoder").anti_resonances)  # 12.1


def test_process_gain_agrees_with_the_model():
    """At low frequency, where the machine moves rigidly."""
    from rtctl.plants import ldu

    p = mechanics.named().model_copy(update={"B_c": 0.0, "B_m": 0.0, "K_m2": 0.0})
    A, B = ldu.state_space(ldu.build(ldu.LduSettings(parameters=p), 1e-4, (1e4, 0.7)))
    s = 2j * np.pi * 2.0
    x = np.linalg.solve(s * np.eye(ldu.NX) - A, B[:, 0])[ldu.CAPSTAN] * p.R_c
    assert abs(x * s**2) == pytest.approx(mechanics.acceleration(p), rel=1e-3)


def test_wavelengths_and_errors_of_chapter_eleven():
    assert mechanics.wavelength(3e-3) == pytest.approx(18.85e-3, rel=1e-3)  # (11.4)
    assert mechanics.disc_error(5e-6, 19e-3) == pytest.approx(3e-4, rel=0.15)  # (11.5)
    assert mechanics.strip_error(1e-4, 0.1, 0.6) == pytest.approx(0.6 * (np.pi * 1e-3) ** 2, rel=1e-3)  # (11.6)


def test_expansion_of_a_steel_wheel():
    """(F.13): 2 mm of a 30 mm wheel; the table says 1e-5, half of it."""
    assert mechanics.disc_inertia(30e-3, 2e-3) == pytest.approx(2.0e-5, rel=0.01)
    assert mechanics.torsion_stiffness(2e-3, 1e-2) == pytest.approx(16 * mechanics.torsion_stiffness(1e-3, 1e-2))
