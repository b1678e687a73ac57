"""Half widths of intervals, and effects compatible with size zero."""

import numpy as np
import pytest
from graph_cases import named

from rtctl.diagnose.likelihood.widths import along, faint, half_widths


def test_every_unknown_has_a_positive_half_width():
    best = named().found.best
    assert half_widths(best).shape == best.x.shape
    assert (half_widths(best) > 0.0).all()


@pytest.mark.parametrize(
    ("pair", "half", "width"), [((3, 0), (1, 4), 1.0), ((0, 3), (1, 4), 4.0), ((3, 4), (1, 4), 3.256)]
)
def test_half_width_of_an_amplitude_follows_its_direction(pair, half, width):
    amplitude, found = along(np.array(pair, float), np.array(half, float))
    assert amplitude == pytest.approx(np.hypot(*pair))
    assert found == pytest.approx(width, abs=1e-3)


def test_effect_of_negligible_size_is_faint():
    best = named().found.best
    assert faint(best) == []
    x = best.x.copy()
    x[best.space.columns(0)[best.space.hypotheses[0].sizes]] *= 1e-3
    assert faint(best._replace(x=x)) == [0]
