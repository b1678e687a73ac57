import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.scope.reduce import envelope, spectrum, thinned


@settings(deadline=None)
@given(st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")), min_size=1, max_size=200), st.integers(1, 40))
def test_envelope_keeps_the_extremes_of_each_column(values, rows):
    both = np.array([values, values[::-1]])
    low, high = envelope(both, rows)
    for k in range(low.shape[1]):
        part = both[:, k * rows : (k + 1) * rows]
        for n in range(2):
            seen = part[n][~np.isnan(part[n])]
            assert (low[n, k], high[n, k]) == (seen.min(), seen.max()) if len(seen) else np.isnan(low[n, k])
    assert low.shape[1] == -(-len(values) // rows)


def test_envelope_shows_one_spike_in_a_million_rows():
    values = np.zeros((1, 1_000_000))
    values[0, 654_321] = 1.0
    low, high = envelope(values, 1000)
    assert np.flatnonzero(high[0]).tolist() == [654]
    assert not low.any()


def test_envelope_of_no_rows_or_signals_is_empty():
    assert envelope(np.empty((0, 50)), 10)[0].shape[0] == 0
    assert envelope(np.empty((2, 0)), 10)[0].shape == (2, 0)


def test_xy_points_end_with_the_newest():
    kept, step = thinned(np.arange(20.0).reshape(2, 10), 4)
    assert step == 3
    assert kept.tolist() == [[0, 3, 6, 9], [10, 13, 16, 19]]


@pytest.mark.parametrize("columns", [5000, 300])
def test_spectrum_of_a_sine_has_its_amplitude_at_its_frequency(columns):
    t = np.arange(5000) * 1e-3
    f, level = spectrum(np.array([3.0 * np.sin(2 * np.pi * 40.0 * t) + 7.0, 0.0 * t]), 1e-3, columns)
    top = level[0].argmax()
    assert level[0, top] == pytest.approx(3.0, rel=1e-6)
    assert f[top] == pytest.approx(40.0, rel=1e-9 if columns > 2500 else 0.015)
    assert level[1].max() < 1e-12
    assert len(f) <= columns


@pytest.mark.parametrize("size", [1e-30, 1e-9, 1.0, 1e30])
def test_spectrum_resolves_small_lines_next_to_large_ones_at_any_scale(size):
    t = np.arange(50_000) * 1e-4
    large, small = np.sin(2 * np.pi * 10.0 * t), 1e-6 * np.sin(2 * np.pi * 700.0 * t)
    f, level = spectrum(size * np.array([large + small, large, 1e3 + small]), 1e-4, 30_000)
    at = round(700.0 / f[0]) - 1
    assert level[0, at] == pytest.approx(1e-6 * size, rel=0.01)  # 120 dB down
    assert level[1, at] < 1e-7 * size
    assert level[2, at] == pytest.approx(1e-6 * size, rel=1e-3)  # the mean is subtracted in full precision


def test_nan_affects_only_the_spectrum_of_its_signal():
    t = np.arange(5000) * 1e-3
    both = np.array([np.sin(2 * np.pi * 40.0 * t), np.sin(2 * np.pi * 40.0 * t)])
    both[0, 17] = np.nan
    _, level = spectrum(both, 1e-3, 5000)
    assert np.isnan(level[0]).all() and level[1].max() == pytest.approx(1.0, rel=1e-6)


def test_spectrum_of_too_few_rows_is_empty():
    f, level = spectrum(np.zeros((2, 5)), 1e-3, 100)
    assert (len(f), level.shape) == (0, (2, 0))
