import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import limit

DT = 0.01
P = limit.build(limit.LimitSettings(high=3.0, low=-2.0), DT)
SLOW = limit.build(limit.LimitSettings(high=3.0, slew=10.0), DT)


def run(p, s, u):
    return [limit.step(p, s, uk) for uk in u]


def test_limit_clips_the_output_and_counts_saturated_ticks(zero):
    s = zero(limit.LIMIT_STATE)
    assert run(P, s, [1.0, 3.0, 4.0, -9.0]) == [1.0, 3.0, 3.0, -2.0]
    assert (s.saturated, s.n_saturated) == (1, 2)
    assert limit.step(P, s, 0.0) == 0.0
    assert (s.saturated, s.n_saturated) == (0, 2)


def test_slew_limit_starts_from_zero_or_from_the_reset_value(zero):
    s = zero(limit.LIMIT_STATE)
    assert run(SLOW, s, [1.0, 1.0, -1.0]) == pytest.approx([0.1, 0.2, 0.1])
    limit.reset(SLOW, s, 2.0)
    assert limit.step(SLOW, s, 9.0) == pytest.approx(2.1)


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=20))
def test_output_never_exceeds_the_limit_or_the_slew_rate(u):
    written = np.array([0.0, *run(SLOW, np.zeros(1, limit.LIMIT_STATE)[0], u)])
    assert np.all(np.abs(written) <= 3.0)
    assert np.all(np.abs(np.diff(written)) <= 0.1 + 1e-12)


def test_nan_command_becomes_zero_volts_and_is_counted(zero):
    s = zero(limit.LIMIT_STATE)
    assert run(P, s, [1.0, math.nan, 2.0]) == [1.0, 0.0, 2.0]
    assert (s.n_nan, s.n_saturated) == (1, 1)


def test_empty_output_range_is_refused():
    with pytest.raises(ValueError, match="lowest output 4 V is not below the highest 3 V"):
        limit.build(limit.LimitSettings(high=3.0, low=4.0), DT)
