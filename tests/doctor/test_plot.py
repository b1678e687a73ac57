import pytest

from rtctl.config.errors import UserError
from rtctl.doctor import plot
from rtctl.doctor.measure import Measured, Rate


@pytest.fixture
def measured(lateness):
    ours = lateness({15_000: 9_000, 60_000: 9, 2_000_000: 1}, late=10)
    return Measured([Rate(500.0, ours, None), Rate(10_000.0, ours, ours)], 1, 80, 1, 5, [], None)


def test_plot_writes_a_png(measured, tmp_path):
    plot.plot(measured, tmp_path / "a.png", "bench")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_plot_axis_covers_all_wakeups(measured):
    low, high = plot._ends(measured.rates)
    assert low < 15 and high > 2_000


def test_coarse_buckets_keep_all_counts(measured):
    h = measured.rates[0].ours
    starts, count = plot.coarse(h)
    assert count.sum() == 9_010 and len(starts) == len(count) + 1
    assert (starts[1:] > starts[:-1]).all()


def test_unwritable_plot_is_an_error(measured, tmp_path):
    with pytest.raises(UserError, match="--plot"):
        plot.plot(measured, tmp_path / "nowhere" / "a.png", "bench")
