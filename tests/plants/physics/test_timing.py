"""Delay, exact for any time, and reproducible jitter."""

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.plants.physics import timing
from rtctl.plants.physics.timing import DelaySettings, JitterSettings, build_delay, build_jitter

H = 1e-3


def delayed(extra: float, u: np.ndarray, h: float = H) -> np.ndarray:
    p, s = build_delay(DelaySettings(node="loop", extra=extra), h), np.zeros(1, timing.DELAY_STATE).view(np.recarray)[0]
    out = np.array(u, float).reshape(len(u), -1)
    for row in out:
        timing.delay(p, s, row)
    return out


def test_delay_shifts_by_whole_and_fractional_substeps():
    u = np.arange(1.0, 20.0)
    assert np.array_equal(delayed(0.0, u)[:, 0], u)
    assert np.array_equal(delayed(3 * H, u)[3:, 0], u[:-3])
    assert np.array_equal(delayed(3 * H, u)[:3, 0], [0, 0, 0])
    assert np.allclose(delayed(2.25 * H, u)[3:, 0], 0.75 * u[1:-2] + 0.25 * u[:-3])


@settings(deadline=None, max_examples=30)
@given(st.floats(0, 0.03), st.floats(0, 1e-4))
def test_delay_is_continuous_in_its_time_and_conserves_the_sum(extra, more):
    u = np.zeros((200, 2))
    u[5:60] = 1.0, -2.0
    one, two = delayed(extra, u), delayed(min(extra + more, 0.03), u)
    assert np.allclose(one.sum(axis=0), u.sum(axis=0))
    assert np.abs(one - two).max() <= 2 * 2.0 * more / H + 1e-9
    assert np.allclose((np.arange(200) @ one - np.arange(200) @ u) / u.sum(axis=0), extra / H)


def test_longest_delay_fits_the_buffer_at_the_finest_step_in_use():
    u = np.random.default_rng(1).normal(size=3000)
    assert np.allclose(delayed(0.03, u, 5e-5)[601:, 0], u[1:-600], atol=1e-9)
    with pytest.raises(UserError, match=r"timing\.delay: 30 ms is .* substeps of 10 us"):
        build_delay(DelaySettings(node="loop", extra=0.03), 1e-5)


def test_delay_above_the_limit_is_clipped_in_a_fit():
    p = build_delay(DelaySettings.model_construct(node="loop", extra=5.0), H)
    assert p.whole + p.part == pytest.approx(30.0)


def test_delay_of_a_plant_shifts_the_recording():
    u = stand.excitation("axis", 400)
    one = stand.run("axis", [], u).y
    two = stand.run("axis", [stand.make("timing.delay", "axis", extra=6e-3)], u).y  # three ticks
    assert np.allclose(two[3:], one[:-3], atol=1e-12)


def jitter(sigma: float, form: str = "gaussian", seed: int = 1) -> timing.JitterParams:
    return build_jitter(JitterSettings(node="loop", sigma=sigma, rate=500.0, seed=seed, form=form), H)


@pytest.mark.parametrize("form", timing.JITTER_FORMS)
def test_jitter_has_its_size_zero_mean_and_no_autocorrelation(form):
    p = jitter(1e-4, form)
    late = np.array([timing.late(p, k / 500) for k in range(1, 8001)])
    assert late.mean() == pytest.approx(0.0, abs=5e-6)
    assert late.std() == pytest.approx(1e-4, rel=0.03)
    assert abs(np.corrcoef(late[1:], late[:-1])[0, 1]) < 0.04
    assert np.mean((late / 1e-4) ** 4) == pytest.approx(3.0 if form == "gaussian" else 1.8, rel=0.1)


def test_jitter_is_reproducible_and_depends_on_the_seed():
    one, two = jitter(1e-4), jitter(1e-4, seed=2)
    assert timing.late(one, 0.246) == timing.late(one, 0.246 + 3e-4) == timing.late(one, 0.246 - 3e-4)
    a = [timing.late(one, k / 500) for k in range(1, 500)]
    b = [timing.late(two, k / 500) for k in range(1, 500)]
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.15
    assert timing.late(one, 0.0) == 0.0


def test_jitter_stays_within_half_a_period():
    late = [timing.late(jitter(0.01), k / 500) for k in range(1, 500)]
    assert max(map(abs, late)) == 1e-3


@pytest.mark.parametrize("kind", stand.PLANTS)
def test_jitter_of_a_plant_shifts_the_sampling_times(kind):
    u = stand.excitation(kind, 200)
    one, two = stand.run(kind, [], u), stand.run(kind, [stand.make("timing.jitter", kind, sigma=1e-4)], u)
    assert np.array_equal(one.x, two.x)  # the motion is unchanged
    p = jitter(1e-4)
    late = np.array([timing.late(p, 2e-3 * (k + 1)) for k in range(200)])
    speed = np.gradient(one.y, 2e-3, axis=0)
    if kind == "ldu":
        speed[:, 0] = one.x[:, 4 + 3]  # the encoder vibrates faster than the tick rate
    for c in range(one.y.shape[1]):
        error = (two.y - one.y)[5:-5, c] - (speed[:, c] * late)[5:-5]
        assert np.abs(error).max() < 0.2 * np.abs(two.y - one.y)[:, c].max()


def test_jitter_of_a_described_machine_shifts_the_sampling_times():
    import machine

    from rtctl.plants.physics import timing

    term = machine.settings("timing.jitter", "loop", sigma=1e-4, rate=1000.0)
    r, even = (machine.run(machine.SCREW, terms, np.full(300, 0.5)) for terms in ([term], []))
    speed = np.gradient(even.y, machine.H, axis=0)[200:-1]
    p = timing.build_jitter(term, machine.H)
    off = np.array([timing.late.py_func(p, t) for t in (np.arange(300) + 1) * machine.H])[200:-1]
    assert r.y[200:-1] - even.y[200:-1] == pytest.approx(speed * off[:, None], rel=5e-2, abs=1e-8)
    assert np.std(off) > 5e-5
