"""Jitter of ticks, seen in errors made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose.jitter import Jitter, allowed_for, cut, growth, interval, jitter, pushed

DT, N = 2e-3, 8000
T = DT * np.arange(N)
WAY = 3000.0 * (1 - np.cos(2 * np.pi * 0.5 * T))  # counts


def stand(error, way=WAY):
    """As much of a simulator as is looked at: the model's way, and a reading that is off by `error` (n,)."""
    record = SimpleNamespace(dt=DT, plant="ivu")
    return SimpleNamespace(
        record=record, seen=way + error, run=lambda model: way[:, None], channels=("capstan_counts",)
    )


def two(late, other):
    """The same of a drive with two sensors, read `late` s (n,) and `other` s (n,), beside their noise."""
    noise = 0.3 * np.random.default_rng(7).standard_normal((2, N))
    ways = np.stack([WAY, 1.9 * WAY])
    main, second = ways + np.gradient(ways, DT, axis=1) * np.stack([late, other]) + noise
    return SimpleNamespace(
        record=SimpleNamespace(dt=DT, plant="ldu", y={"scale_counts": second}), seen=main, run=lambda model: ways.T,
        channels=("encoder_counts", "scale_counts"),
    )  # fmt: skip


def found(error):
    return jitter(stand(error), None, slice(10, None))  # type: ignore[arg-type]


def off(sigma, seed=0, noise=0.35):
    rng = np.random.default_rng(seed)
    return np.gradient(WAY, DT) * sigma * rng.standard_normal(N) + noise * rng.standard_normal(N)


@settings(deadline=None, max_examples=20)
@given(st.floats(1e-4, 6e-4), st.integers(0, 1000))
def test_its_size_is_found_within_its_interval(sigma, seed):
    seen = found(off(sigma, seed))
    assert seen.sigma == pytest.approx(sigma, rel=0.1)
    low, high = interval(seen)
    assert low < seen.sigma < high < 1.2 * sigma


def test_where_ticks_are_on_time_there_is_none():
    assert found(off(0.0)) is None
    assert found(off(2e-6)) is None


def test_what_any_clock_does_is_allowed_for_and_not_told():
    seen = found(off(4e-5))  # a fiftieth of a tick
    assert seen.sigma == pytest.approx(4e-5, rel=0.1) and not seen.told
    assert found(off(1e-4)).told
    weighed = []

    def again(weights):
        weighed.append(weights)
        return SimpleNamespace(louder=1.0)

    problem = SimpleNamespace(
        sim=stand(0.0), channels=[0], rows=slice(0, None), sigma=0.35, mean=1, allowing=again, beside=lambda s: s
    )
    assert allowed_for(problem, None, seen).louder == 1.0  # type: ignore[arg-type]
    speed = np.abs(np.gradient(WAY, DT))
    np.testing.assert_allclose(weighed[0], 0.35 / np.hypot(0.35, speed * seen.sigma))
    assert allowed_for(problem, None, seen._replace(sigma=1e-4)).louder > 1.0  # type: ignore[arg-type]


def test_an_error_that_is_smooth_is_none_however_much_it_grows_with_speed():
    smooth = np.gradient(WAY, DT) * 4e-4 * np.sin(2 * np.pi * 9.0 * T)
    assert found(smooth + off(0.0)) is None


def test_vibration_at_speed_is_none():
    """At a tenth of the sample rate it is not smooth, but neighbouring ticks know of each other."""
    ringing = np.gradient(WAY, DT) * 4e-4 * np.sin(2 * np.pi * 50.0 * T)
    assert found(ringing + off(0.0)) is None


def test_it_stands_beside_a_missing_effect():
    seen = found(off(3e-4) + 40.0 * np.sin(2 * np.pi * 1.0 * T))
    assert seen.sigma == pytest.approx(3e-4, rel=0.1)


def test_a_machine_that_hardly_moves_shows_none():
    still = 0.01 * WAY
    error = off(0.0)
    assert jitter(stand(error, still), None, slice(10, None)) is None  # type: ignore[arg-type]


def test_sensors_that_are_read_at_the_same_ticks_are_late_together():
    late = 2e-4 * np.random.default_rng(3).standard_normal(N)
    both, one = (jitter(two(late, other), None, slice(10, None)) for other in (late, 0.0 * late))  # type: ignore[arg-type]
    assert both.sigma == pytest.approx(2e-4, rel=0.1)
    assert one is None


def test_growth_is_the_slope_of_noise_power():
    rng = np.random.default_rng(0)
    x = rng.uniform(0, 4, 20000)
    slope, error, rest = growth((1.0 + 0.5 * x) * rng.standard_normal(20000) ** 2, x, np.zeros(20000))
    assert slope == pytest.approx(0.5, abs=4 * error)
    assert rest == pytest.approx(1.0, rel=0.1)
    assert 0.0 < error < 0.05


def test_a_late_tick_under_a_derivative_pushes_along_the_motion():
    """Each command answers its own tick's lateness d by -D v d, and acts d less long: D v sigma^2 on average."""
    rng, sigma, D = np.random.default_rng(1), 3e-4, 0.02
    late, v = sigma * rng.standard_normal(N), np.gradient(WAY, DT)
    volts = -D * (v * late)[:, None]
    sim = SimpleNamespace(
        record=SimpleNamespace(dt=DT),
        seen=WAY + v * late,
        volts=volts,
        run=lambda model: WAY[:, None],
        commanded=np.copy,
    )
    more = pushed(sim, None, Jitter(sigma, 0.0))[:, 0] - volts[:, 0]  # type: ignore[arg-type]
    force = D * v * sigma**2 / DT
    assert float(more @ force / (force @ force)) == pytest.approx(1.0, abs=0.1)
    assert pushed(sim, None, Jitter(1e-9, 0.0, 1.0))[:, 0] == pytest.approx(volts[:, 0], abs=1e-6)  # type: ignore[arg-type]


@pytest.mark.parametrize("fastest", [0.9, 1.2, 1.8, 3.0])
@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
def test_what_cutting_into_counts_makes_near_one_count_a_tick_is_none(fastest, noise):
    way = WAY * fastest / (np.abs(np.gradient(WAY, DT)).max() * DT)
    rng = np.random.default_rng(3)
    error = np.floor(way + noise * rng.standard_normal(N)) + 0.5 - way
    assert jitter(stand(error, way), None, slice(10, None)) is None  # type: ignore[arg-type]


def test_beside_what_cutting_makes_late_ticks_are_seen():
    way = WAY * 3.0 / (np.abs(np.gradient(WAY, DT)).max() * DT)
    late = 0.3 * DT * np.random.default_rng(4).standard_normal(N)
    error = np.floor(way + np.gradient(way, DT) * late) + 0.5 - way
    seen = jitter(stand(error, way), None, slice(10, None))  # type: ignore[arg-type]
    assert seen.sigma == pytest.approx(0.3 * DT, rel=0.1)


@pytest.mark.parametrize("speed", [0.3, 0.75, 1.0, 1.5, 2.2])
def test_the_power_of_cutting_is_that_of_cut_readings(speed):
    way = (speed + 1.7e-4) * np.arange(200_000)  # so that it is cut at any place
    e = np.floor(way) - way
    d = e[1:-1] - 0.5 * (e[:-2] + e[2:])
    assert np.mean(d**2) / 1.5 == pytest.approx(float(cut(np.array([speed]))[0]), abs=0.006)
