"""Two-reel unit against the values of the thesis (chapters 4, 6, 8, appendix A) and its errata."""

import math
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import l292
from rtctl.idiom import fill_record, record_dtype, tick
from rtctl.plants import ivu, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph import reel

COUNT = 2 * math.pi / 10_000  # of the capstan encoder, rad
AMP_PER_VOLT = 0.2
DRIVER = l292.L292Settings()
DRIVE = (*l292.second_order(DRIVER), DRIVER.R_F * DRIVER.C_F)
DELAY = 3e-3  # s, delay of the loop in 8.2
G, TAU_D = 6.2, 0.16  # A/rad, s
FREE: dict[str, Any] = {"tau_F1": 0.0, "tau_F2": 0.0, "tau_Fc": 0.0}  # parameters without friction


def built(name: str = "identified", h: float = 5e-4, **parameters: float) -> ivu.IvuParams:
    return ivu.build(ivu.IvuSettings(set=name, parameters=parameters), h, [DRIVE, DRIVE])


def plant(p: ivu.IvuParams) -> tuple[Any, Any]:
    """Params and initial state as records."""
    rows = np.zeros(1, record_dtype(p)).view(np.recarray)
    fill_record(rows[0], p)
    s = np.zeros(1, ivu.IVU_STATE).view(np.recarray)[0]
    graph.start(rows[0].graph, s)
    return rows[0], s


@tick
def run(p, s, n):
    """`n` substeps with the inputs of the state."""
    for _ in range(n):
        linear.midpoint(s.m)
        graph.weigh(p.graph, s.m)
        linear.advance(s.m)


@tick
def record_run(p, s, u, every, out):
    """`every` substeps for each row of volts `u` (n, 2); capstan and tensions into `out` (n, 3)."""
    for k in range(u.shape[0]):
        s.m.u[0] = u[k, 0]
        s.m.u[1] = u[k, 1]
        run(p, s, every)
        out[k, 0] = s.m.x[ivu.CAPSTAN]
        out[k, 1] = linear.tension(s.m, 0)
        out[k, 2] = linear.tension(s.m, 1)


@tick
def closed_run(p, s, ref, every, T1, T2, out):
    """PD law of 8.2 at 500 Hz on the unquantised capstan angle; tension on both motors, one motor pulls (5.1)."""
    e = 0.0
    d = 0.0
    u = 0.0
    for k in range(ref.shape[0]):
        s.m.u[0] = T1 + max(u, 0.0)
        s.m.u[1] = T2 + max(-u, 0.0)
        was = e
        e = ref[k] - s.m.x[ivu.CAPSTAN]
        d += 0.4 * ((e - was) / 2e-3 - d)
        u = 31.0 * (e + 0.16 * d)  # written a tick later
        run(p, s, every)
        out[k] = s.m.x[ivu.CAPSTAN]


def response(p: ivu.IvuParams, f: np.ndarray, driver: bool = True) -> np.ndarray:
    """Frequency response of the capstan angle in rad per ampere on motor 1, with or without the driver lag."""
    A, B = ivu.state_space(p)
    n, b = (len(A), B[:, 0] / AMP_PER_VOLT) if driver else (2 * ivu.NQ, A[: 2 * ivu.NQ, 2 * ivu.NQ])
    return np.array([np.linalg.solve(2j * np.pi * x * np.eye(n) - A[:n, :n], b[:n])[ivu.CAPSTAN] for x in f])


def modes(p: ivu.IvuParams, below: float = 1000.0) -> list[tuple[float, float]]:
    """Frequency in Hz and damping of the oscillating modes of the machine."""
    A, _ = ivu.state_space(p)
    mechanical = np.linalg.eigvals(A[: 2 * ivu.NQ, : 2 * ivu.NQ])
    found = [(abs(x) / (2 * np.pi), -x.real / abs(x)) for x in mechanical if x.imag > 1.0]
    return sorted((f, zeta) for f, zeta in found if f < below)


def process_gain(p: ivu.IvuParams) -> float:
    return float(abs(response(p, np.array([1.0]))[0]) * (2 * np.pi) ** 2)


def margins(driver: bool = False, **radii: Any) -> tuple[float, float, float]:
    """Gain margin in dB, phase margin in degrees and crossover in Hz of the PD loop with delay."""
    f = np.geomspace(1.0, 200.0, 4000)
    L = response(built(**radii), f, driver) * G * (1 + 2j * np.pi * f * TAU_D) * np.exp(-2j * np.pi * f * DELAY)
    gain, phase = np.abs(L), np.unwrap(np.angle(L))
    phase -= 2 * np.pi * round((phase[0] + np.pi) / (2 * np.pi))  # begins near -180
    last = np.flatnonzero((gain[:-1] >= 1) & (gain[1:] < 1))
    crossover = last[0] if len(last) else 0
    turns = np.flatnonzero(np.diff(np.sign(phase + np.pi)) < 0)
    turns = turns[f[turns] > 5]
    return -20 * math.log10(gain[turns[0]]), math.degrees(phase[crossover] + np.pi), float(f[crossover])


def test_process_gain_of_the_identified_set():
    assert process_gain(built()) == pytest.approx(25.4, rel=0.03)


def test_modes_of_the_identified_set():
    (f1, zeta1), (f2, zeta2), *_ = modes(built())
    assert (f1, f2) == pytest.approx((2.6, 41.6), rel=0.03)
    assert (zeta1, zeta2) == pytest.approx((0.22, 0.22), abs=0.01)


def test_modes_of_the_simulation_set():
    """Erratum: 250 Hz at R1 = 20 mm needs J_10 of 3.2e-5; with the listed 1e-5 it is 450 Hz."""
    frequencies = dict(modes(built("simulation")))
    assert [f for f in frequencies if f > 10] == pytest.approx([103, 450], rel=0.01)
    assert frequencies[min(frequencies, key=lambda f: abs(f - 103))] == pytest.approx(0.028, abs=0.001)
    empty = [f for f, _ in modes(built("simulation", R1=0.02, R2=0.02, J_10=3.2e-5, J_20=3.2e-5)) if f > 10]
    assert empty == pytest.approx([250, 250], rel=0.05)


def test_process_gain_of_the_simulation_set():
    """Erratum: 64 with the listed J_m, 32 (the text has 31.6) with the identified one."""
    assert process_gain(built("simulation", R1=0.02, R2=0.02)) == pytest.approx(64, rel=0.01)
    assert process_gain(built("simulation", R1=0.02, R2=0.02, J_m1=1.5e-3, J_m2=1.5e-3)) == pytest.approx(32, rel=0.02)


def test_reel_inertia_follows_from_the_radius_or_the_given_value():
    p = built()
    assert pytest.approx((1.91e-4, 8.3e-6), rel=5e-3) == (p.J_1, p.J_2)
    assert built(J_1=5e-4).J_1 == 5e-4


def test_reel_deflection_under_tension_of_the_simulation_set():
    """Erratum: section 6.1 prints twice the value."""
    p, s = plant(built("simulation", h=1e-3, R1=0.03, R2=0.03, d_tape=0.0, **FREE))
    s.m.u[:2] = 0.049 / AMP_PER_VOLT
    run(p, s, 20_000)
    wanted = 0.049 * 0.061 / (100.0 * 0.03**2)
    assert wanted == pytest.approx(3.3e-2, rel=0.01)
    assert (s.m.x[ivu.REEL1], s.m.x[ivu.REEL2]) == pytest.approx((wanted, wanted), rel=1e-3)
    assert abs(s.m.x[ivu.CAPSTAN]) < 1e-9
    T = linear.tension(s.m, 0), linear.tension(s.m, 1)
    assert pytest.approx((0.049 * 0.061 / 0.03,) * 2, rel=1e-3) == T


def test_margins_of_the_pd_loop():
    assert margins() == (pytest.approx(5.2, abs=0.1), pytest.approx(72, abs=1), pytest.approx(9.6, abs=0.2))


@pytest.mark.parametrize(("R1", "R2", "dB"), [(0.040, 0.040, 1.2), (0.040, 0.020, 3.7), (0.020, 0.020, 20.9)])
def test_gain_margin_over_the_radii(R1, R2, dB):
    """Erratum: 'stable for the complete range of reel radii' is true, but barely; hence gain scheduling."""
    assert margins(R1=R1, R2=R2)[0] == pytest.approx(dB, abs=0.1)
    assert margins(R1=R1, R2=R2, driver=True)[0] == pytest.approx(dB, abs=0.2)  # with the lag of the driver


def test_driver_gain_matches_the_data_sheet():
    A, B = ivu.state_space(built())
    a = 2 * ivu.NQ
    assert -np.linalg.solve(A[a : a + 2, a : a + 2], B[a : a + 2, 0])[0] == pytest.approx(AMP_PER_VOLT)


def test_rigid_rotation_is_an_eigenvector_with_eigenvalue_one():
    """Rigid rotation persists: the drift of the capstan is below one count per hour."""
    for p in (built(), built("simulation"), built(R1=0.02, R2=0.04)):
        _, s = plant(p)
        rigid = np.zeros(ivu.NX)
        rigid[[0, 1, 2, 3, 4]] = 1 / p.R1, 1 / p.R1, 1 / p.R_c, -1 / p.R2, -1 / p.R2
        error = np.abs(s.m.Phi_T.T[: ivu.NX, : ivu.NX] @ rigid - rigid).max() / np.abs(rigid).max()
        assert error * 3600 / p.h < 1e-4


@settings(deadline=None, max_examples=25)
@given(st.floats(-60, 60), st.floats(0.022, 0.04), st.floats(0.022, 0.04))
def test_radius_wound_length_and_inertia_agree(q, R1, R2):
    """dl = R dq, dJ = 2 pi rho h R^3 dR (4.1-4.4)."""
    p, s = plant(built(R1=R1, R2=R2))
    s.m.qm[ivu.REEL1], s.m.qm[ivu.REEL2] = q, -q
    graph.weigh(p.graph, s.m)
    grow = p.d_tape / (2 * math.pi)
    assert min(s.m.reel_R[:2]) >= p.R_min * (1 - 1e-9)
    if p.R_min < s.m.reel_R[0]:
        paper = 2 * math.pi / p.d_tape * grow * (s.m.reel_R[0] ** 2 - R1**2) / (2 * grow)  # area over thickness
        assert reel.wound(q, R1, grow, p.R_min) == pytest.approx(paper, abs=1e-9)
    assert pytest.approx(reel.reel_inertia(p.J_10, p.rho_h, s.m.reel_R[0], p.R_min), rel=1e-9) == s.m.reel_J[0]
    assert pytest.approx(reel.reel_inertia(p.J_20, p.rho_h, s.m.reel_R[1], p.R_min), rel=1e-9) == s.m.reel_J[1]
    dq = 1e-5
    slope = (reel.wound(q + dq, R1, grow, p.R_min) - reel.wound(q - dq, R1, grow, p.R_min)) / (2 * dq)
    assert slope == pytest.approx(s.m.reel_R[0], rel=1e-6)


def exact_accelerations(p: Any, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Accelerations (5,) by (4.9)-(4.17) with the radii at q."""
    grow = p.d_tape / (2 * math.pi)
    R1, R2 = p.R1 + grow * q[ivu.REEL1], p.R2 + grow * q[ivu.REEL2]
    J1, J2 = (reel.reel_inertia(p.J_10, p.rho_h, R, p.R_min) for R in (R1, R2))
    l1 = (R1**2 - p.R1**2) / (2 * grow)
    l2 = (R2**2 - p.R2**2) / (2 * grow)
    F1 = p.c1 * (p.R_c * q[ivu.CAPSTAN] - l1) + p.k1 * (p.R_c * v[ivu.CAPSTAN] - R1 * v[ivu.REEL1])
    F2 = p.c2 * (-p.R_c * q[ivu.CAPSTAN] - l2) + p.k2 * (-p.R_c * v[ivu.CAPSTAN] - R2 * v[ivu.REEL2])
    tau1 = p.c_m1 * (q[ivu.MOTOR1] - q[ivu.REEL1]) + p.k_m1 * (v[ivu.MOTOR1] - v[ivu.REEL1])
    tau2 = p.c_m2 * (q[ivu.MOTOR2] - q[ivu.REEL2]) + p.k_m2 * (v[ivu.MOTOR2] - v[ivu.REEL2])
    out = np.zeros(5)
    out[ivu.MOTOR1], out[ivu.MOTOR2] = -tau1 / p.J_m1, -tau2 / p.J_m2
    out[ivu.REEL1], out[ivu.REEL2] = (F1 * R1 + tau1) / J1, (F2 * R2 + tau2) / J2
    out[ivu.CAPSTAN] = p.R_c * (F2 - F1) / p.J_c
    return out


@settings(deadline=None, max_examples=30)
@given(st.floats(-20, 20), st.lists(st.floats(-1, 1), min_size=9, max_size=9))
def test_linear_model_and_radius_correction_give_the_equations_of_motion(turned, x):
    """At any wound length, also between two relinearisations."""
    record, s = plant(built(R1=0.03, R2=0.03))
    q = np.array([turned, turned, 0.03 * turned / 0.0125, -turned, -turned])
    q[:4] += 0.02 * np.array(x[:4])
    v = 5.0 * np.array(x[4:])
    s.m.qm[:5], s.m.vm[:5] = q, v
    graph.weigh(record.graph, s.m)
    got = s.m.A[5:10, :5] @ q + s.m.A[5:10, 5:10] @ v + s.m.G[5:10, 2:7] @ s.m.f[:5]
    np.testing.assert_allclose(got, exact_accelerations(record, q, v), rtol=1e-9, atol=1e-6)


def driven(p: ivu.IvuParams, volts: np.ndarray, dt: float) -> tuple[Any, Any, np.ndarray]:
    record, s = plant(p)
    out = np.zeros((len(volts), 3))
    record_run(record, s, volts, round(dt / p.h), out)
    return record, s, out


def test_tape_length_between_the_reels_is_conserved():
    """Over one reel turn the wound lengths differ only by the elongation."""
    volts = np.full((4000, 2), 0.17)
    volts[:2000, 0] += 1.5
    record, s, _ = driven(built(h=1e-3), volts, 1e-3)
    grow = record.d_tape / (2 * math.pi)
    x = s.m.x
    l1 = reel.wound(x[ivu.REEL1], record.R1, grow, record.R_min)
    l2 = reel.wound(x[ivu.REEL2], record.R2, grow, record.R_min)
    assert l1 > 0.2  # m
    stretch = linear.tension(s.m, 0) / record.c1 + linear.tension(s.m, 1) / record.c2
    assert l1 + l2 == pytest.approx(stretch, abs=2e-3)
    assert record.R_c * x[ivu.CAPSTAN] == pytest.approx(l1, abs=2e-3)
    assert (
        pytest.approx(record.d_tape * l1 / math.pi, rel=1e-4) == s.m.reel_R[0] ** 2 - record.R1**2
    )  # evaluated at the middle of the substep
    assert pytest.approx(reel.reel_inertia(record.J_10, record.rho_h, s.m.reel_R[0], record.R_min)) == s.m.reel_J[0]
    assert s.m.reel_R[0] > record.R1 and s.m.reel_R[1] < record.R2


def test_empty_reel_keeps_the_core_radius_and_inertia():
    volts = np.full((6000, 2), 0.1)
    volts[:, 0] += 1.5
    record, s, _ = driven(built(h=1e-3, R2=0.0202), volts, 1e-3)
    assert record.R2 + record.d_tape / (2 * math.pi) * s.m.x[ivu.REEL2] < record.R_min  # the reel is empty
    assert record.R_min == s.m.reel_R[1]
    assert pytest.approx(record.J_20, rel=1e-6) == s.m.reel_J[1]
    assert np.all(np.isfinite(s.m.x))


def stored(p: Any, s: Any) -> float:
    """Energy in J at the present radii."""
    q, v = s.m.x[: ivu.NQ], s.m.x[ivu.NQ : 2 * ivu.NQ]
    inertia = np.array([p.J_m1, s.m.reel_J[0], p.J_c, s.m.reel_J[1], p.J_m2])
    grow = p.d_tape / (2 * math.pi)
    e1 = p.R_c * q[ivu.CAPSTAN] - reel.wound(q[ivu.REEL1], p.R1, grow, p.R_min)
    e2 = -p.R_c * q[ivu.CAPSTAN] - reel.wound(q[ivu.REEL2], p.R2, grow, p.R_min)
    springs = p.c_m1 * (q[0] - q[1]) ** 2 + p.c_m2 * (q[4] - q[3]) ** 2 + p.c1 * e1**2 + p.c2 * e2**2
    return 0.5 * float(inertia @ v**2 + springs)


@settings(deadline=None, max_examples=15)
@given(st.lists(st.floats(-1, 1), min_size=10, max_size=10), st.sampled_from([0.0, 0.5e-3]))
def test_energy_of_the_undriven_unit_never_increases(x, d_tape):
    """Passive also with changing radii: tape layers carry their momentum to and from the reels."""
    record, s = plant(built(d_tape=d_tape, **FREE))
    s.m.x[:5] = 0.02 * np.array(x[:5])
    s.m.x[5:10] = 3.0 * np.array(x[5:])
    s.m.v_before[:5] = s.m.x[5:10]
    last = stored(record, s)
    for _ in range(40):
        run(record, s, 50)
        now = stored(record, s)
        assert now <= last * (1 + (1e-9 if d_tape == 0.0 else 1e-3)) + 1e-12
        last = now


def test_unit_with_friction_comes_to_rest():
    volts = np.zeros((6000, 2))
    volts[:500, 0] = 0.5
    _, s, _ = driven(built(h=1e-3), volts, 1e-3)
    assert np.abs(s.m.x[ivu.NQ : 2 * ivu.NQ]).max() < 1e-6


@lru_cache(maxsize=8)
def open_loop(h: float) -> np.ndarray:
    """Open-loop run of 10 s with a reversal each second; volts switch on whole seconds."""
    wave = 0.5 * np.where((np.arange(5000) // 500) % 2 == 0, 1.0, -1.0)
    return driven(built(h=h), 0.17 + np.stack([wave, -wave], axis=1), 2e-3)[2]


@lru_cache(maxsize=8)
def closed_loop(h: float) -> np.ndarray:
    """Closed-loop run with shaped steps of 1 rad under the PD law of 8.2."""
    t = np.arange(4000) * 2e-3
    ref = np.zeros(len(t))
    for begin, size in ((0.5, 1.0), (3.0, -1.0), (5.5, -1.0)):
        w = 8.0 * np.maximum(t - begin, 0.0)
        ref += size * (1 - np.exp(-w) * (1 + w + w**2 / 2))
    record, s = plant(built(h=h))
    out = np.zeros(len(t))
    closed_run(record, s, ref, round(2e-3 / h), 0.31, 0.18, out)
    assert abs(out[1400] - 1.0) < 0.1
    return out


@pytest.mark.parametrize("loop", [open_loop, closed_loop])
def test_integration_error_is_below_a_tenth_of_a_count(loop):
    whole, half = loop(5e-4), loop(2.5e-4)
    capstan = np.abs(whole - half) if whole.ndim == 1 else np.abs(whole - half)[:, 0]
    assert capstan.max() < 0.1 * COUNT


def test_integration_error_against_a_substep_16_times_shorter():
    """Step halving does not show this error: a motor breaks away while its current still rises, within 0.1 ms.

    The model then slides for the whole substep: about 1e-4 rad/s once, below one count.
    """
    assert np.abs(open_loop(5e-4) - open_loop(5e-4 / 16))[:, 0].max() < 0.5 * COUNT


def test_substep_allocates_no_memory(allocations):
    record, s = plant(built())
    s.m.u[:2] = 0.3
    assert allocations(run, record, s, 1000) == allocations(run, record, s, 1)


def test_motor_parameters_of_appendix_e_are_reflected_through_the_gear():
    """Appendix E: 61 mNm/A and 24 mA without load, times 150.4."""
    p = ivu.parameters(ivu.IvuSettings(set="appendix_e"))
    assert p.K_m1 == p.K_m2 == pytest.approx(150.4 * 61e-3, rel=1e-3)
    assert p.tau_F1 == p.tau_F2 == pytest.approx(150.4 * 61e-3 * 24e-3, rel=2e-3)
    assert p.tau_F1 / p.R_min > 10.0  # N of tape tension to back-drive the gear
