"""Direction-dependent friction: different levels in both directions, no driving force."""

import bench
import numpy as np
import pytest

F_C, K, M = 20.4, 35.15, 95.1


def run(inputs: np.ndarray, substeps: int = 4, F_v: float = 0.0, **changes: float) -> bench.Run:
    term = bench.usual("friction.asymmetry", "axis", **{"a": 0.3, "B_a": 0.0, **changes})
    return bench.run("axis", [term], inputs, substeps=substeps, F_v=F_v)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("a", [0.3, -0.2])
def test_sliding_friction_depends_on_the_direction(way, a):
    r = run(np.full(500, way * 2.0), a=a)
    rate = (r.v[-1, 0] - r.v[100, 0]) / 0.399
    assert rate == pytest.approx(way * (2.0 * K - F_C * (1 + way * a)) / M, rel=1e-9)


@pytest.mark.parametrize(("force", "moves"), [(25.0, False), (28.0, True), (-13.0, False), (-16.0, True)])
def test_break_away_force_depends_on_the_direction(force, moves):
    ramp = np.concatenate([np.linspace(0, force, 1000), np.full(200, force)])
    assert (np.abs(run(ramp / K).q[-1, 0]) > 1e-4) == moves


def test_asymmetric_friction_never_drives_an_axis_at_rest():
    r = run(np.concatenate([np.zeros(100), np.full(100, 2.0), np.zeros(3000)]))
    assert np.abs(r.q[:100]).max() < 1e-18  # rounding error
    assert np.abs(r.v[-1000:]).max() < 1e-15


def test_asymmetric_viscous_friction_depends_on_the_direction():
    there, back = (run(np.full(500, way * 3.0), a=0.0, B_a=20.0) for way in (1.0, -1.0))
    slow = run(np.full(500, 3.0), a=0.0)
    assert abs(there.q[-1, 0]) < abs(slow.q[-1, 0]) < abs(back.q[-1, 0])


def test_asymmetric_friction_is_limited_to_zero():
    r = run(np.full(4000, -3.0), a=0.0, B_a=1e3)  # unlimited friction would be negative above 2 cm/s
    rate = np.diff(r.v[-100:, 0]) / 1e-3
    assert rate == pytest.approx(-3.0 * K / M, rel=1e-9)


def test_asymmetry_reduces_the_viscous_friction_at_most_to_zero():
    """Backwards, B_a = 200 Ns/m cancels F_v = 200 Ns/m; only dry friction remains."""
    r = run(np.full(2000, -3.0), F_v=200.0, a=0.0, B_a=200.0)
    rate = np.diff(r.v[-100:, 0]) / 1e-3
    assert rate == pytest.approx(-(3.0 * K - F_C) / M, rel=1e-3)


def test_reversal_with_asymmetric_friction_is_as_accurate_as_with_symmetric_friction():
    inputs = bench.moves("axis")
    exact, plain_exact = run(inputs, 32), run(inputs, 32, a=0.0)
    off, plain_off = (np.abs(run(inputs, 1, a=a).q - e.q).max() for a, e in ((0.3, exact), (0.0, plain_exact)))
    assert off < 2 * plain_off < 1e-6


def test_asymmetry_equals_symmetric_friction_plus_a_constant_force():
    """In sliding, sticking and reversal, asymmetry a equals a drive offset of F_C a."""
    inputs = bench.moves("axis")
    tilted = run(inputs)
    pushed = bench.run("axis", [], inputs - 0.3 * F_C / K, substeps=4, F_v=0.0)
    np.testing.assert_allclose(tilted.q, pushed.q, atol=1e-12)
