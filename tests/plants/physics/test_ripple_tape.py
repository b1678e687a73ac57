"""Eccentric wheels: the path is the integral of the lever arm; a turn does no work."""

import math

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants import ivu, linear
from rtctl.plants.physics import ripple_tape

H = 5e-4
phases = st.floats(-4, 4)


def reel(**values: float) -> ripple_tape.WheelParams:
    return ripple_tape.build_reel(ripple_tape.ReelSettings(node="reel1", **{"e": 0.0, **values}), H)


def capstan(**values: float) -> ripple_tape.WheelParams:
    return ripple_tape.build_capstan(ripple_tape.CapstanSettings(node="capstan", **{"a": 0.0, **values}), H)


@settings(deadline=None)
@given(phases, phases, phases, st.floats(-50, 50))
def test_lever_arm_is_the_derivative_of_the_path(phi, phi2, phi3, q):
    p = reel(e=1e-3, phi=phi, e2=3e-4, phi2=phi2, e3=-2e-4, phi3=phi3)
    d = 1e-5
    slope = (ripple_tape.way(p, q + d) - ripple_tape.way(p, q - d)) / (2 * d)
    assert ripple_tape.arm(p, q) == pytest.approx(slope, abs=1e-9)
    radius = 1e-3 * math.cos(q + phi) + 3e-4 * math.cos(2 * q + phi2) - 2e-4 * math.cos(3 * q + phi3)
    assert ripple_tape.arm(p, q) == pytest.approx(radius, abs=1e-15)
    assert ripple_tape.way(p, 0.0) == 0.0
    assert ripple_tape.way(p, q + 2 * math.pi) == pytest.approx(ripple_tape.way(p, q), abs=1e-12)


def test_path_error_of_the_capstan_matches_the_thesis():
    """Radius 3 mm +- 2 um as one sine per turn: path error at most 4 um (11.3, figure 11.2)."""
    p = capstan(a=2e-6, phi=-math.pi / 2)
    e = [ripple_tape.way(p, q) for q in np.linspace(0, 2 * math.pi, 361)]
    assert max(map(abs, e)) == pytest.approx(4e-6, rel=1e-4)


def forces(act, node: int, q: np.ndarray, v: np.ndarray, damped: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Node forces (5,) of linear springs and term at the midpoint q, v (5,), and tensions (2,) of both tapes."""
    _, s = stand.plant("ivu", H, d_tape=0.0, **({} if damped else {"k1": 0.0, "k2": 0.0}))
    s.m.qm[:5], s.m.vm[:5] = q, v
    linear_part = np.zeros(5)
    for j in (0, 1):
        T = linear.tension(s.m, j)
        linear_part[s.m.link_i[j]] -= s.m.link_a[j] * T
        linear_part[s.m.link_j[j]] -= s.m.link_b[j] * T
    act(s.m, node)
    return linear_part + s.m.f[:5], np.array([linear.tension(s.m, 0), linear.tension(s.m, 1)])


def together(p: ripple_tape.WheelParams, way, arm):
    """Function that applies the path line and the lever-arm line in sequence."""

    def both(m, i):
        way(p, m, i)
        arm(p, m, i)

    return both


REEL = (
    lambda p, m, i: ripple_tape.reel(p, m, i, ripple_tape.tape_of(m, i)),
    lambda p, m, i: ripple_tape.reel_arm(p, m, i, ripple_tape.tape_of(m, i)),
)
SPANS = (
    lambda p, m, i: ripple_tape.spans(p, m, i, 0, 1),
    lambda p, m, i: ripple_tape.spans_arm(p, m, i, 0, 1),
)
CASES = {
    "reel1": (ivu.REEL1, reel(e=2e-3, phi=0.4, e2=1e-3, phi2=2.0), *REEL),
    "reel2": (ivu.REEL2, reel(e=2e-3, phi=0.4, e3=1e-3, phi3=2.0), *REEL),
    "capstan": (
        ivu.CAPSTAN, capstan(a=5e-4, phi=0.4, a2=3e-4, phi2=1.0), ripple_tape.capstan, ripple_tape.capstan_arm,
    ),
    "described capstan": (ivu.CAPSTAN, capstan(a=5e-4, phi=0.4, a2=3e-4, phi2=1.0), *SPANS),
}  # fmt: skip


@pytest.mark.parametrize("node", CASES)
def test_forces_of_an_eccentric_wheel_derive_from_a_potential(node):
    """Each force is the negative gradient of the spring energy at the true stretch; a cycle does no work."""
    at, p, way, arm = CASES[node]
    both = together(p, way, arm)

    def stretches(q: np.ndarray) -> tuple[float, float]:
        one = 0.038 * q[ivu.REEL1] - 0.0125 * q[ivu.CAPSTAN]
        two = 0.022 * q[ivu.REEL2] + 0.0125 * q[ivu.CAPSTAN]
        extra = ripple_tape.way(p, q[at])
        if node.endswith("capstan"):
            return one - extra, two + extra
        return (one + extra, two) if node == "reel1" else (one, two + extra)

    def energy(q: np.ndarray) -> float:
        return 0.5 * 450.0 * sum(e * e for e in stretches(q))

    rng = np.random.default_rng(3)
    for _ in range(20):
        q = rng.normal(size=5) * 3
        force, pulls = forces(both, at, q, np.zeros(5))
        slope = np.array([(energy(q + d) - energy(q - d)) / 2e-5 for d in 1e-5 * np.eye(5)])
        assert np.allclose(force, -slope, rtol=1e-6, atol=1e-6)
        assert np.allclose(pulls, 450.0 * np.array(stretches(q)))


@pytest.mark.parametrize("node", CASES)
def test_tape_stiffening_includes_the_stretch_of_an_eccentric_wheel(node):
    """With a cubic spring the forces derive from a potential with a fourth power."""
    at, p, way, arm = CASES[node]
    c3, d = 3e7, 1e-5

    def stretched(q: np.ndarray) -> tuple[np.ndarray, list[float]]:
        def both(m, i):
            way(p, m, i)
            e.extend(linear.stretch(m, j) for j in (0, 1))
            for j in (0, 1):
                linear.pull(m, j, c3 * e[j] ** 3)
            arm(p, m, i)

        e: list[float] = []
        force, _ = forces(both, at, q, np.zeros(5))
        return force, e

    def energy(q: np.ndarray) -> float:
        return sum(0.5 * 450.0 * e**2 + 0.25 * c3 * e**4 for e in stretched(q)[1])

    rng = np.random.default_rng(5)
    for _ in range(5):
        q = rng.normal(size=5) * 0.3
        q[at] += 1.0
        slope = np.array([(energy(q + step) - energy(q - step)) / (2 * d) for step in d * np.eye(5)])
        assert np.allclose(stretched(q)[0], -slope, atol=1e-5 * np.abs(slope).max())


@pytest.mark.parametrize("node", CASES)
def test_tape_damper_at_an_eccentric_wheel_dissipates_energy(node):
    at, p, way, arm = CASES[node]
    both = together(p, way, arm)

    rng = np.random.default_rng(4)
    for _ in range(50):
        q, v = rng.normal(size=5) * 3, rng.normal(size=5)
        still, _ = forces(both, at, q, np.zeros(5), damped=True)
        moving, _ = forces(both, at, q, v, damped=True)
        assert (moving - still) @ v <= 1e-12


def test_reel_eccentricity_is_visible_and_linear_in_its_size():
    u = np.tile([0.9, 0.3], (2500, 1))  # both pull, motor 1 winds

    def wave(volts: np.ndarray, e: float) -> np.ndarray:
        term = stand.make("ripple.reel", "ivu", "reel1", e=e, phi=1.0)
        options = {"d_tape": 0.0, "tau_F1": 0.0, "tau_F2": 0.0, "tau_Fc": 0.0}
        return stand.run("ivu", [term], volts, **options).x - stand.run("ivu", [], volts, **options).x

    change = wave(u, 2e-4)
    assert np.allclose(wave(u, 4e-4), 2 * change, atol=0.05 * np.abs(change).max())  # proportional to e
    assert np.abs(change[:, ivu.CAPSTAN]).max() > 3 * 2 * np.pi / 10_000


def test_capstan_eccentricity_of_the_linear_drive_changes_only_the_scale():
    u = stand.excitation("ldu", 300)
    one, two = stand.run("ldu", [], u), stand.run("ldu", [stand.make("ripple.capstan", "ldu", a=2e-6, phi=1.0)], u)
    assert np.array_equal(one.x, two.x) and np.array_equal(one.y[:, 0], two.y[:, 0])
    theta = one.x[:, 2]
    assert np.allclose(two.y[:, 1] - one.y[:, 1], 2e-6 * (np.sin(theta + 1) - math.sin(1)), atol=1e-12)
