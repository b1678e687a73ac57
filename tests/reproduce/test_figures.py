import numpy as np
import pytest
from PIL import Image

from rtctl.reproduce import figures


def test_figure_is_saved_small_and_legible(tmp_path):
    figure, (axes, *_) = figures.panels(2, 2)
    figures.line(axes, np.arange(200_000), np.sin(np.arange(200_000)), label="wave")
    figures.legend(axes)
    path = figures.save(figure, tmp_path, "11.10")
    assert path.name == "figure_11_10.png" and path.stat().st_size < 60_000
    with Image.open(path) as image:
        assert image.size == (720, 440)


def test_long_line_is_decimated():
    _, (axes,) = figures.panels(1)
    figures.line(axes, np.arange(100_000), np.zeros(100_000))
    assert np.size(axes.lines[0].get_xdata()) < 2000


@pytest.mark.parametrize("start", [-180.0, 180.0, 179.9])
def test_phase_of_a_mass_starts_at_minus_180(start):
    phase = figures.degrees(np.exp(1j * np.radians([start, start - 100, start - 200])))
    assert phase[0] == pytest.approx(-180, abs=1)
    assert np.diff(phase) == pytest.approx([-100, -100])


def test_decibels_of_zero_are_finite():
    assert np.isfinite(figures.db([0.0, 1.0])).all()
