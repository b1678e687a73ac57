import fused
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.design import margins, pd, response, robustness


def test_pd_of_the_thesis():
    """8.2: G = 6.2 A/rad and tau_d = 0.16 s for 2 Hz; through 0.2 A/V."""
    found = pd.design(fused.config("ivu"), 4 * np.pi)
    assert found.gain * 0.2 == pytest.approx(6.2, rel=0.02)
    assert found.tau_d == pytest.approx(0.16, rel=0.01)
    made = pd.applied(fused.config("ivu"), found)
    assert made.law.position.gain == found.gain
    assert made.law.position.derivative_filter == 40.0  # unchanged


def simulation(J_m: float, R1: float, R2: float):
    config = fused.config(
        "ivu", plant__set="simulation", plant__parameters__J_m1=J_m, plant__parameters__J_m2=J_m,
        law__position__gain=1.25 * 5, law__position__tau_d=0.32,
    )  # fmt: skip
    return robustness.with_radii(config, R1, R2)


@pytest.mark.parametrize(("J_m", "K_p"), [(7.5e-4, 64.0), (1.5e-3, 31.6)])
def test_pd_of_the_simulation_parameters(J_m, K_p):
    """5.2: K_p = 31.6 and G = 1.25 A/rad hold for empty reels, and for the J_m that was identified later (erratum)."""
    found = pd.design(simulation(J_m, 0.02, 0.02), 2 * np.pi)
    assert found.K_p * 5 == pytest.approx(K_p, rel=0.03)
    assert found.gain / 5 == pytest.approx(1.25 * 31.6 / K_p, rel=0.03)
    assert found.tau_d == pytest.approx(0.32, rel=0.01)


def test_phase_margin_over_the_radii_of_the_simulation_parameters():
    """5.2: 88 deg at 40/20 mm; and 75 deg, which is what 20/20 has. 20/40 has 56."""
    f = np.geomspace(0.05, 60, 4000)
    for R1, R2, PM in ((0.04, 0.02, 88), (0.02, 0.02, 75), (0.02, 0.04, 56)):
        L = response.plant(simulation(1.5e-3, R1, R2), f) * 6.25 * (1 + 0.32 * 2j * np.pi * f)
        m = margins.points(f, L)
        assert m.stable and pytest.approx(PM, abs=2.0) == m.PM


def test_pole_placement_on_a_double_integrator():
    f = np.geomspace(0.1, 10, 50)
    found = pd.of_points(f, 3.0 / (2j * np.pi * f) ** 2, 5.0, 0.7)
    assert found.K_p == pytest.approx(3.0)
    poles = np.roots([1, found.K_p * found.gain * found.tau_d, found.K_p * found.gain])
    assert np.abs(poles) == pytest.approx([5.0, 5.0])
    assert -poles.real / np.abs(poles) == pytest.approx([0.7, 0.7])


def test_linear_drive_gets_a_pd():
    made = pd.applied(fused.config("ldu"), pd.design(fused.config("ldu"), 2 * np.pi * 2))
    assert made.law.position.kind == "pd"
    assert margins.of_config(made).stable


def test_gain_outside_of_the_band_is_refused():
    f = np.geomspace(2, 10, 5)
    with pytest.raises(NoAnswer, match="from 2 to 10 Hz"):
        pd.of_points(f, 1 / f**2 + 0j, 5.0)
