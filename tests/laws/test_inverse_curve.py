import numpy as np
import pytest

from rtctl.laws import inverse_curve

P = inverse_curve.build(
    inverse_curve.InverseCurveSettings(points=[(-9.6, -10.0), (-0.1, -0.5), (0.1, 0.5), (9.6, 10.0)]), 0.001
)


def test_inverse_curve_compensates_a_dead_band():
    for wanted in np.linspace(-9, 9, 37):
        command = inverse_curve.step(P, wanted)
        if abs(wanted) > 0.1:
            assert np.sign(command) * max(abs(command) - 0.4, 0.0) == pytest.approx(wanted)
    assert inverse_curve.step(P, 0.0) == 0.0


def test_inverse_curve_extrapolates_linearly_beyond_its_points():
    assert inverse_curve.step(P, 20.0) == pytest.approx(20.4)
    assert inverse_curve.step(P, -20.0) == pytest.approx(-20.4)


@pytest.mark.parametrize("points", [[(0, 0), (0, 1)], [(0, 1), (1, 0)], [(1, 0), (0, 1)]])
def test_curve_that_does_not_rise_is_refused(points):
    with pytest.raises(ValueError, match="must rise"):
        inverse_curve.build(inverse_curve.InverseCurveSettings(points=points), 0.001)
