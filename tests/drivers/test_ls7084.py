import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import ls7084

H = 1e-4
LINES = 2500
QUARTER = 2 * math.pi / (4 * LINES)


def make(**keys):
    return ls7084.build(ls7084.Ls7084Settings(**{"lines": LINES, **keys}), 0.002)


X4, X1 = make(), make(multiply=1)
# Large steps, small ones, and angles exactly on edges; H is long enough that none is lost up to a turn a millisecond.
angles = st.one_of(st.floats(-0.02, 0.02), st.floats(-3e-3, 3e-3), st.integers(-9, 9).map(lambda q: q * QUARTER))


def run(p, path, h=H):
    s = np.zeros(1, ls7084.LS7084_STATE)[0]
    return s, [ls7084.step(p, s, float(theta), h) for theta in path]


@settings(deadline=None)
@given(st.lists(angles, min_size=1, max_size=50))
def test_x4_counts_are_the_difference_of_floors_for_any_path(path):
    s, pulses = run(X4, path)
    floors = [math.floor(theta * X4.quarters_per_radian) for theta in path]
    assert s["lost"] == 0
    assert list(np.cumsum(pulses)) == [f - floors[0] for f in floors]


@settings(deadline=None)
@given(st.lists(angles, min_size=1, max_size=50))
def test_x1_stays_within_a_line_of_the_angle(path):
    _, pulses = run(X1, path)
    n = math.floor(path[0] * X1.quarters_per_radian) // 4
    for theta, pulse in zip(path, pulses, strict=True):
        n += pulse
        quarter = math.floor(theta * X1.quarters_per_radian)
        assert 4 * n - 3 < quarter < 4 * n + 4


def decode_x1(quarters):
    """Reference decoder of the signals: one pulse per rising edge of A, up when B is low."""
    pulses = [0]
    for before, after in pairwise(quarters):
        rises = after % 4 in (0, 1) and before % 4 not in (0, 1)
        pulses.append((-1 if after % 4 in (1, 2) else 1) if rises else 0)
    return pulses


FORTH_AND_BACK = [*range(0, 30), *range(28, -32, -1), *range(-30, 9)]  # reversals while A is high


@pytest.mark.parametrize("path", [range(0, 40), range(0, -40, -1), FORTH_AND_BACK])
def test_x1_counts_one_edge_of_a_with_the_direction_of_b(path):
    _, pulses = run(X1, [(q + 0.5) * QUARTER for q in path])
    assert pulses == decode_x1(path)


@settings(deadline=None)
@given(st.integers(-50, 50), st.integers(1, 200), st.sampled_from((X4, X1)))
def test_vibration_on_an_edge_does_not_accumulate_counts(edge, times, p):
    path = [(edge - 0.4) * QUARTER, (edge + 0.4) * QUARTER] * times
    _, pulses = run(p, [*path, path[0]])
    assert abs(np.cumsum(pulses)).max() <= 1
    if p is X4:
        assert pulses[1:].count(1) == pulses[1:].count(-1) == times


@settings(deadline=None)
@given(st.floats(0.01, 1.0), st.floats(0, 1), st.sampled_from((-1, 1)), st.floats(1e-6, 1e-4))
def test_no_count_is_lost_up_to_the_highest_rate(share, start, sign, h):
    step = sign * share * X4.highest_rate * h * QUARTER
    s, pulses = run(X4, [start * QUARTER + k * step for k in range(300)], h)
    assert s["lost"] == 0
    assert abs(sum(pulses) - 299 * step / QUARTER) < 1.001


@settings(deadline=None)
@given(st.floats(1.02, 20.0), st.sampled_from((-1, 1)))
def test_count_above_the_highest_rate_lags_by_the_lost_pulses(share, sign):
    step = sign * share * X4.highest_rate * H * QUARTER
    s, pulses = run(X4, [0.5 * QUARTER + k * step for k in range(300)])
    asked = abs(math.floor(0.5 + 299 * step / QUARTER))
    assert s["lost"] > 0
    assert abs(sum(pulses)) + s["lost"] == pytest.approx(asked, abs=1)
    assert abs(sum(pulses)) == pytest.approx(299 * X4.highest_rate * H, abs=2)


def test_exactly_the_highest_rate_is_not_too_fast():
    h = 0.1 / X4.highest_rate  # a tenth of a pulse a substep: a sum of tenths falls short of one
    s, pulses = run(X4, [(0.5 + (k + 4) // 10) * QUARTER for k in range(5000)], h)
    assert (sum(pulses), s["lost"]) == (500, 0)


def test_rest_does_not_raise_the_highest_rate_of_a_burst():
    s, pulses = run(X4, [0.5 * QUARTER] * 100 + [1000.5 * QUARTER])
    assert (pulses[-1], s["lost"]) == (101, 899)  # a hundred in 0.1 ms and the one that was ready


def test_pulse_width_and_filter_set_the_highest_rate():
    assert ls7084.highest_rate(ls7084.Ls7084Settings(pulse_width="2 us")) == pytest.approx(0.5e6)
    assert ls7084.highest_rate(ls7084.Ls7084Settings(filter=5e-6)) == pytest.approx(0.2e6)
    assert ls7084.highest_rate(ls7084.Ls7084Settings(filter=5e-6, multiply=1)) == pytest.approx(0.05e6)


def test_counts_per_turn_and_radians():
    assert X4.counts_per_rev == 10_000
    assert ls7084.radians(X1, 2500) == pytest.approx(2 * math.pi)


def test_first_call_takes_the_position_without_pulses():
    _, pulses = run(X4, [1.2345, 1.2345 + 3.01 * QUARTER])
    assert pulses[0] == 0 and pulses[1] == 3
    assert run(X4, [0.0, math.nan, 0.0])[1] == [0, 0, 0]
