"""Attached resonator with exact step and conserved momentum; stiffening spring."""

import bench
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from rtctl.plants.physics import structure

M = 95.1


@settings(deadline=None)
@given(st.floats(1, 300), st.floats(0, 0.9), st.floats(1e-5, 1e-3))
def test_resonator_step_is_the_matrix_exponential(f, zeta, h):
    p = structure.build_resonance(structure.ResonanceSettings(node="carriage", f_Hz=f, mass=1.0, zeta=zeta), h)
    w = 2 * np.pi * f
    exact = expm(np.array([[0.0, 1.0], [-w * w, -2 * zeta * w]]) * h)
    assert np.array([[p.a11, p.a12], [p.a21, p.a22]]) == pytest.approx(exact, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("share", [0.1, 1.0, 2.0])
def test_resonator_conserves_momentum_and_rings_at_the_coupled_frequency(share):
    term = bench.usual("structure.resonance", "axis", f_Hz=50.0, mass=share * M, zeta=0.0)
    r = bench.run("axis", [term], np.zeros(2000), speeds={"carriage": 0.1}, F_v=0.0, F_c=0.0, substeps=8)
    swing = r.v[:, 0] - 0.1 / (1 + share)
    assert abs(r.v[:, 0].mean() - 0.1 / (1 + share)) < 2e-4
    crossings = np.count_nonzero(np.diff(np.sign(swing)))
    assert crossings == pytest.approx(2 * 2.0 * 50.0 * np.sqrt(1 + share), abs=2)
    assert np.abs(swing[-200:]).max() == pytest.approx(np.abs(swing[:200]).max(), rel=0.02)  # constant amplitude


def test_resonator_is_a_rigid_mass_below_its_frequency():
    term = bench.usual("structure.resonance", "axis", f_Hz=200.0, mass=0.5 * M, zeta=0.05)
    r = bench.run("axis", [term], np.linspace(0, 2, 1000), F_v=0.0, F_c=0.0)
    rigid = bench.run("axis", [], np.linspace(0, 2, 1000), F_v=0.0, F_c=0.0, M=1.5 * M)
    assert r.q[-1, 0] == pytest.approx(rigid.q[-1, 0], rel=1e-4)


def test_cubic_spring_balances_the_applied_force():
    c3 = 1e6
    term = bench.usual("structure.stiffening", "axis", c3=c3)
    r = bench.run("axis", [term], np.minimum(np.linspace(0, 2, 8000), 1.0), k=1e4, F_c=0.0, F_v=2e3)
    x = r.q[-1, 0]
    assert 1e4 * x + c3 * x**3 == pytest.approx(35.15, rel=1e-3)


@given(st.floats(-1, 1), st.floats(-1e6, 1e6))
def test_cubic_stiffening_force_is_odd(e, c3):
    p = structure.StiffeningParams(c3, 0.0, 0.0, 2.0, 1.0)
    assert structure.stiffening(p, -e, 0.0) == -structure.stiffening(p, e, 0.0)


def test_quadratic_stiffening_force_is_even():
    p = structure.StiffeningParams(0.0, 2e5, 0.0, 2.0, 1.0)
    assert structure.stiffening(p, 0.01, 0.0) == structure.stiffening(p, -0.01, 0.0) == pytest.approx(20.0)


@given(st.floats(-1, 1), st.floats(-10, 10), st.floats(0, 1e6))
def test_deflection_dependent_damping_dissipates_energy(e, v, b2):
    p = structure.StiffeningParams(0.0, 0.0, b2, 2.0, 1.0)
    assert structure.stiffening(p, e, v) * v >= 0.0


def test_larger_oscillation_decays_faster():
    def kept(start: float) -> float:
        """Ratio of the late to the early oscillation amplitude."""
        terms = [bench.usual("structure.stiffening", "axis", c3=0.0, b2=b2)]
        r = bench.run("axis", terms, np.where(np.arange(20000) < 5000, start, 0.0), k=95.1 * (2 * np.pi * 5) ** 2,
                      F_v=20.0, F_c=0.0)  # fmt: skip
        swing = np.abs(r.q[5000:, 0])
        return swing[-2500:].max() / swing[:2500].max()

    b2 = 1e9
    assert kept(1.0) < 0.9 * kept(0.1)


@given(st.floats(1e-6, 1.0), st.floats(0.5, 6.0))
def test_power_law_stiffening_equals_the_cubic_at_the_reference_deflection(bend, power):
    p = structure.StiffeningParams(1e6, 0.0, 0.0, power, bend)
    cubic = structure.StiffeningParams(1e6, 0.0, 0.0, 2.0, bend)
    assert structure.stiffening(p, bend, 0.0) == pytest.approx(structure.stiffening(cubic, bend, 0.0))
    twice = structure.stiffening(p, 2.0 * bend, 0.0) / structure.stiffening(p, bend, 0.0)
    assert twice == pytest.approx(2.0 ** (power + 1.0))
