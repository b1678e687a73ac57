"""Capstan drive against figure 12.2 and appendix F of the thesis, and its errata."""

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eig

from rtctl.idiom import fill_record, record_dtype, tick
from rtctl.plants import ldu, linear
from rtctl.plants.graph import plant as graph

AMPLIFIER = (2 * np.pi * 2000.0, 0.7071)
H = 5e-5
N = 20.0
COUNT = 2 * np.pi / 20_000 * 3e-3  # of the encoder, m at the carriage


def built(name: str = "figure_12_2", h: float = H, **parameters: float) -> ldu.LduParams:
    return ldu.build(ldu.LduSettings(set=name, parameters=parameters), h, AMPLIFIER)


def plant(p: ldu.LduParams) -> Any:
    rows = np.zeros(1, record_dtype(p)).view(np.recarray)
    fill_record(rows[0], p)
    s = np.zeros(1, ldu.LDU_STATE).view(np.recarray)[0]
    graph.start(rows[0].graph, s)
    return s


@tick
def run(s, amperes, every, out):
    """`every` substeps for each current in `amperes`; carriage angle, then encoder angle, into `out` (n, 2)."""
    for k in range(amperes.shape[0]):
        s.m.u[0] = amperes[k]
        for _ in range(every):
            linear.midpoint(s.m)
            linear.advance(s.m)
        out[k, 0] = s.m.x[ldu.CAPSTAN]
        out[k, 1] = s.m.x[ldu.ENCODER]


def motion(s: Any, amperes: np.ndarray, every: int = 1) -> np.ndarray:
    out = np.zeros((len(amperes), 2))
    run(s, np.asarray(amperes, float), every, out)
    return out


def mechanics(p: ldu.LduParams) -> tuple[np.ndarray, np.ndarray]:
    """A (8, 8) without the amplifier, and the input column (8,) of the motor current."""
    A, _ = ldu.state_space(p)
    return A[:8, :8], A[:8, 8]


def resonances(p: ldu.LduParams) -> list[float]:
    values = np.linalg.eigvals(mechanics(p)[0])
    return sorted(abs(x) / (2 * np.pi) for x in values if x.imag > 1.0)


def antiresonances(p: ldu.LduParams, node: int) -> list[float]:
    """Zeros in Hz from motor current to node angle: generalised eigenvalues of the Rosenbrock matrix."""
    A, b = mechanics(p)
    rosenbrock, mask = np.zeros((9, 9)), np.zeros((9, 9))
    rosenbrock[:8, :8], rosenbrock[:8, 8], rosenbrock[8, node] = A, b, 1.0
    mask[:8, :8] = np.eye(8)
    zeros = eig(rosenbrock, mask, right=False)
    return sorted(abs(z) / (2 * np.pi) for z in zeros[np.isfinite(zeros)] if 1.0 < z.imag < 1e5)


def test_resonances_of_figure_12_2():
    f1, f2, f3 = resonances(built())
    assert 114 <= f1 <= 119
    assert f2 == pytest.approx(287, rel=0.03)
    assert f3 == pytest.approx(2100, rel=0.03)


def test_resonances_of_appendix_f():
    """Erratum: the listed k_s and k_c do not give the figure."""
    assert resonances(built("appendix_f")) == pytest.approx([239, 951, 3261], rel=3e-3)


@pytest.mark.parametrize(("name", "f"), [("figure_12_2", 254), ("appendix_f", 919)])
def test_antiresonance_frequency_of_the_encoder_on_the_capstan_shaft(name, f):
    assert antiresonances(built(name), ldu.CAPSTAN) == pytest.approx([f], rel=0.01)


@pytest.mark.parametrize("name", ["figure_12_2", "appendix_f"])
def test_modal_damping_is_between_1_and_10_percent(name):
    values = np.linalg.eigvals(mechanics(built(name))[0])
    zeta = [-x.real / abs(x) for x in values if x.imag > 1.0]
    assert min(zeta) > 0.01 and max(zeta) < 0.1


@pytest.mark.parametrize("name", ["figure_12_2", "appendix_f"])
def test_low_frequency_gain_is_that_of_the_total_inertia(name):
    p = built(name)
    A, b = mechanics(p)
    w = 2 * np.pi * 5.0
    x = np.linalg.solve(1j * w * np.eye(8) - A, b)
    J = N**2 * p.J_m + p.J_t + p.J_c + p.M * p.R_c**2 + p.J_e
    for node, ratio in ((ldu.MOTOR, N), (ldu.WHEEL, 1), (ldu.CAPSTAN, 1), (ldu.ENCODER, 1)):
        assert abs(x[node]) * w**2 == pytest.approx(ratio * N * p.K_m1 / J, rel=0.02)


def test_rigid_rotation_is_an_eigenvector_with_eigenvalue_one():
    s = plant(built())
    rigid = np.zeros(ldu.NX)
    rigid[:4] = N, 1, 1, 1
    assert np.abs(s.m.Phi_T.T[: ldu.NX, : ldu.NX] @ rigid - rigid).max() < 1e-11


def test_amplifier_settles_at_the_commanded_current():
    s = plant(built(F_c=1000.0))
    motion(s, np.full(200, 0.2))
    assert s.m.x[8] == pytest.approx(0.2, rel=1e-6)


def breakaway(p: ldu.LduParams) -> float:
    """Break-away current in A of the dry friction of the carriage."""
    return p.R_c * p.F_c / (N * p.K_m1)


@pytest.mark.parametrize("sign", [-1, 1])
def test_dry_friction_holds_the_carriage_below_break_away(sign):
    p = built()
    s = plant(p)
    held = motion(s, sign * 0.8 * breakaway(p) * np.minimum(np.arange(10_000) / 4000, 1.0))  # ramp without ringing
    assert np.abs(held[:, 0]).max() * p.R_c < 2e-3 * COUNT
    windup = sign * 0.8 * p.R_c * p.F_c / p.k_c  # wheel against capstan
    assert s.m.x[ldu.WHEEL] - s.m.x[ldu.CAPSTAN] == pytest.approx(windup, rel=0.05)  # residual oscillation
    moving = motion(s, np.full(10_000, sign * 1.5 * breakaway(p)))
    a = 0.5 * p.R_c * p.F_c / (N**2 * p.J_m + p.J_t + p.J_c + p.M * p.R_c**2 + p.J_e)
    assert moving[-1, 0] * sign == pytest.approx(a * 0.5**2 / 2, rel=0.1)


def test_break_away_current_is_proportional_to_the_carriage_friction():
    """The friction is a force in N at the capstan radius."""
    light, heavy = (breakaway(built(F_c=F_c)) for F_c in (5.0, 10.0))
    assert heavy == pytest.approx(2 * light) and light == pytest.approx(3e-3 * 5 / 0.42)


@lru_cache(maxsize=4)
def pushed(h: float) -> np.ndarray:
    """Carriage position (m) of a motion in both directions, with sticking in between."""
    t = np.arange(5000) * 1e-4
    amperes = np.where(t < 0.1, 0.1, np.where(t < 0.2, -0.1, np.where(t < 0.3, 0.02, 0.08)))
    return motion(plant(built(h=h)), amperes, round(1e-4 / h)) * 3e-3


def test_integration_error_is_below_a_tenth_of_a_count():
    whole, half = pushed(H), pushed(H / 2)
    assert np.abs(whole).max() > 1000 * COUNT
    assert np.abs(whole - half).max() < 0.1 * COUNT


def test_frictionless_motion_is_exact_for_any_step():
    amperes = np.repeat([0.1, -0.1, 0.05], 500)
    exact = [motion(plant(built(h=h, F_c=0.0)), amperes, round(1e-4 / h)) for h in (1e-4, 2.5e-5)]
    np.testing.assert_allclose(exact[0], exact[1], atol=1e-9)
