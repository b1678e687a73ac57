import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import linear_scale

P = linear_scale.build(linear_scale.LinearScaleSettings(), 1e-3)


@settings(deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=50))
def test_scale_counts_are_the_difference_of_floors(path):
    s = np.zeros(1, linear_scale.LINEAR_SCALE_STATE)[0]
    counts = np.cumsum([linear_scale.step(P, s, x) for x in path])
    floors = [math.floor(x * P.counts_per_metre) for x in path]
    assert list(counts) == [f - floors[0] for f in floors]
    assert abs(linear_scale.metres(P, counts[-1]) - (path[-1] - path[0])) < 0.5e-6 * (1 + 1e-6)


def test_scale_has_two_counts_per_micrometre():
    assert linear_scale.metres(P, 2) == pytest.approx(1e-6)
    s = np.zeros(1, linear_scale.LINEAR_SCALE_STATE)[0]
    assert [linear_scale.step(P, s, x) for x in (0.1e-6, 1.2e-6, math.nan, 0.1e-6)] == [0, 2, 0, -2]
