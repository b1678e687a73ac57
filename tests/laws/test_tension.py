import pytest

from rtctl.laws import tension

DT = 0.002
P = tension.build(tension.TensionSettings(F_t=0.1, ramp=0.1), DT)


def volts(s):
    return s.V1, s.V2


def test_tension_voltage_gives_the_torque(zero):
    s = zero(tension.TENSION_STATE)
    for _ in range(60):
        tension.step(P, s, 0.04, 0.02)
    full = 0.1 * 0.04 / (0.061 * 0.2)
    assert volts(s) == pytest.approx((full, full / 2))


def test_tension_grows_linearly_after_arming(zero):
    s = zero(tension.TENSION_STATE)
    full = 0.1 * 0.04 / (0.061 * 0.2)
    before = 0.0
    for k in range(50):
        tension.step(P, s, 0.04, 0.02)
        assert s.V1 - before == pytest.approx(full / 50)
        assert s.share == pytest.approx((k + 1) / 50)
        before = s.V1
    tension.reset(P, s)
    tension.step(P, s, 0.04, 0.02)
    assert volts(s) == pytest.approx((full / 50, full / 100))


def test_tension_without_a_ramp_starts_at_its_full_value(zero):
    s = zero(tension.TENSION_STATE)
    tension.step(tension.build(tension.TensionSettings(F_t=0.2, ramp=0.0), DT), s, 0.03, 0.03)
    assert s.V1 == s.V2 == pytest.approx(0.2 * 0.03 / (0.061 * 0.2))
