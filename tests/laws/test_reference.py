import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import reference

DT = 0.002
STEPS = [{"at": "0.1 s", "to": "1 rad"}, {"at": 0.3, "to": 0.0, "ramp": "5 rad/s"}]


def built(**choices):
    return reference.build(reference.ReferenceSettings(**choices), DT)


P = built(steps=STEPS)
NONE = np.zeros(1, reference.SETPOINT)[0]


def run(p, s, ticks, c=NONE):
    return np.array([reference.step(p, s, c, k) for k in ticks])


def setpoint(seq, target, rate):
    return np.array([(seq, target, rate)], reference.SETPOINT)[0]


def test_reference_plays_steps_and_ramps_at_their_ticks(zero, record):
    r = run(P, zero(reference.REFERENCE_STATE), range(400))
    assert np.all(r[:50] == 0.0) and np.all(r[50:150] == 1.0)
    assert r[200] == pytest.approx(0.5)
    assert np.all(r[250:] == 0.0)
    assert np.array_equal(run(record(P), zero(reference.REFERENCE_STATE), range(400)), r)


@settings(deadline=None)
@given(st.integers(1, 100_000))
def test_step_starts_at_its_tick_despite_rounded_times(k):
    p = built(knots=[(0.0, 0.0), (round(k * DT, 9), 0.0), (round(k * DT, 9), 1.0)])
    r = run(p, np.zeros(1, reference.REFERENCE_STATE)[0], [k - 1, k])
    assert list(r) == [0.0, 1.0]


def test_reference_repeats_bit_exact(zero):
    p = built(steps=STEPS, repeat="0.6 s")
    r = run(p, zero(reference.REFERENCE_STATE), range(900))
    assert np.array_equal(r[:300], r[300:600]) and np.array_equal(r[:300], r[600:])
    assert r.max() == 1.0


def test_reference_direction_is_the_sign_of_the_last_change(zero):
    s = zero(reference.REFERENCE_STATE)
    seen = []
    for k in range(400):
        reference.step(P, s, NONE, k)
        seen.append(int(s.direction))
    assert (seen[49], seen[50], seen[149], seen[160], seen[399]) == (0, 1, 1, -1, -1)


def test_arming_holds_the_position_and_relative_playback_starts_there(zero):
    s = zero(reference.REFERENCE_STATE)
    reference.hold(P, s, 7.0)
    assert list(run(P, s, range(100, 160))) == [7.0] * 60
    reference.start(P, s, 160)
    r = run(P, s, range(160, 560))
    assert r[0] == r[49] == 7.0 and r[50] == 8.0 and r[-1] == 7.0


def test_absolute_playback_ignores_the_held_position(zero):
    p, s = built(steps=STEPS, relative=False), zero(reference.REFERENCE_STATE)
    reference.hold(p, s, 7.0)
    reference.start(p, s, 0)
    assert run(p, s, range(60))[-1] == 1.0


def test_setpoint_ends_the_table_and_moves_at_its_rate(zero):
    s = zero(reference.REFERENCE_STATE)
    run(P, s, range(100))
    r = run(P, s, range(100, 700), setpoint(1, -1.0, 2.0))
    assert np.abs(np.diff([1.0, *r])).max() == pytest.approx(2.0 * DT)
    assert r[-1] == -1.0
    assert run(P, s, [700], setpoint(2, 3.0, 0.0)) == 3.0


def test_reference_without_a_table_waits_for_setpoints(zero):
    p, s = built(), zero(reference.REFERENCE_STATE)
    assert list(run(p, s, range(10))) == [0.0] * 10
    assert run(p, s, [10], setpoint(1, 0.25, 0.0)) == 0.25


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"steps": STEPS, "knots": [(0, 0)]}, "not both"),
        ({"steps": [STEPS[1], STEPS[0]]}, "step 2 at 0.1 s comes before"),
        ({"steps": [{"at": 0, "to": 1, "ramp": 0.1}, {"at": 5, "to": 0}]}, "ended, at 10 s"),
        ({"steps": STEPS, "repeat": 0.2}, "repeat 0.2 s ends before the table"),
        ({"knots": [(0.1 * i, 0) for i in range(2049)]}, "2049 knots; 2048 are the most"),
        ({"knots": [(1, 0), (0, 0)]}, "not fall"),
    ],
)
def test_invalid_reference_table_is_refused(choices, words):
    with pytest.raises(ValueError, match=words):
        built(**choices)


def test_reference_units_follow_the_machine():
    metre = reference.MetreReferenceSettings(steps=[{"at": 0, "to": "2 mm", "ramp": "5 mm/s"}])
    assert metre.steps[0].to == pytest.approx(0.002)
    with pytest.raises(ValueError):
        reference.ReferenceSettings(steps=[{"at": 0, "to": "2 mm"}])
