"""Figures of frequency responses: content, and unwritable files."""

from typing import Any

import frf_runs
import pytest

from rtctl.config.errors import UserError
from rtctl.identify import frf_figures, model_fit, sensitivity
from rtctl.trace import plot


def labels(figure: Any) -> list[str]:
    return [axes.get_ylabel() for axes in figure.axes]


def legend(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


def test_figure_of_the_sensitivity(tmp_path):
    result = sensitivity.identify(frf_runs.noise())
    figure = frf_figures.sensitivity(result, model=result.S)
    assert labels(figure) == ["|S| [dB]", "phase of S [deg]", "coherence", "|H| [dB, rad/V]"]
    plot.save(figure, tmp_path / "s.png")
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(UserError, match="cannot be written"):
        plot.save(figure, tmp_path / "none" / "s.png")


def test_figure_of_the_best_linear_approximation():
    figure = frf_figures.best_linear(frf_runs.response())
    assert legend(figure)[-1] == "even distortion"


def test_figure_of_the_fit_has_a_colour_for_each_response():
    frfs = [frf_runs.response("ivu", motor).frf for motor in (1, 2)]
    figure = frf_figures.model_fit(model_fit.fit(frfs, frf_runs.config()))
    said = legend(figure)
    assert "motor 1, 38.0/22.0 mm" in said and "motor 2, 38.0/22.0 mm" in said
    phase: Any = figure.axes[1].lines[0].get_ydata()
    assert -200 < phase[0] < -160  # a mass
