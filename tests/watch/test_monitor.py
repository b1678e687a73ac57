"""A monitor leaves a healthy machine in peace, notices an effect that begins in mid-run, and tells faults as faults."""

import numpy as np
import pytest
import yaml

from rtctl.config.load import set_path
from rtctl.watch.monitor import Monitor
from rtctl.watch.rehearsal import Shift

STICKS = {"term": "friction.stribeck", "node": "motor2", "F_s": 4.3e-3, "v_s": 0.24}


@pytest.fixture
def monitor(rehearsed):
    return Monitor(rehearsed.case, band=rehearsed.band)


def test_it_learns_and_a_healthy_machine_is_left_in_peace(rehearsed, monitor):
    assert monitor.state == "waiting"
    assert monitor.feed(rehearsed.after) is None
    assert monitor.state == "watching"
    assert monitor.judged > 50
    assert monitor.notes == []


def test_pieces_of_any_size_are_judged_alike(rehearsed):
    one, many = (Monitor(rehearsed.case, band=rehearsed.band) for _ in range(2))
    one.feed(rehearsed.after)
    at = 0
    for size in np.random.default_rng(0).integers(1, 3000, 1000):
        many.feed(rehearsed.after[at : at + size])
        at += size
    assert many.judged == one.judged
    np.testing.assert_allclose(many.sums.value, one.sums.value, atol=1e-9)


def test_a_drive_that_begins_to_stick_is_noticed_within_half_a_minute_of_motion(rehearsed, monitor):
    shift, rng = Shift(rehearsed.config), np.random.default_rng(5)
    assert monitor.feed(shift.play(rehearsed.moves, rng, 30.0)) is None
    other = shift.become(set_path(rehearsed.config, "plant.physics.0", STICKS))
    began, judged = other.tick / other.machine.rate, monitor.judged
    alarm = None
    while alarm is None and monitor.judged - judged < 30:
        alarm = monitor.feed(other.play(rehearsed.moves, rng, 2.0))
    assert alarm is not None
    assert alarm.t > began
    assert monitor.alarm == alarm
    assert " mNm" in alarm.words or " uNm" in alarm.words or "scatters" in alarm.words


def test_lost_rows_are_noted_and_are_no_alarm(rehearsed, monitor):
    rows = rehearsed.after
    assert monitor.feed(rows[:20_000]) is None
    assert monitor.feed(rows[21_000:40_000]) is None
    assert monitor.lost == 1000
    assert [note for note in monitor.notes if note.startswith("1000 rows did not come")]
    assert monitor.feed(rows[45_000:], lost=5000) is None
    assert monitor.lost == 6000


def test_a_clock_that_jumps_is_noted_and_is_no_alarm(rehearsed, monitor):
    rows = rehearsed.after.copy()
    rows["t"][30_000:] += 3600.0
    assert monitor.feed(rows) is None
    assert [note for note in monitor.notes if "clock of the rows jumped by +3.6e+03 s" in note]


def test_a_machine_that_is_started_anew_is_noted_and_is_no_alarm(rehearsed, monitor):
    assert monitor.feed(rehearsed.after[:30_000]) is None
    again = Shift(rehearsed.config).play(rehearsed.moves, np.random.default_rng(6), 30.0)
    assert monitor.feed(again) is None
    assert [note for note in monitor.notes if "started anew" in note]


def test_late_rows_are_not_judged(rehearsed, monitor):
    rows = rehearsed.after.copy()
    late = np.random.default_rng(7).random(len(rows)) < 0.01
    rows["t"][late] += 0.5 / 500.0
    assert monitor.feed(rows) is None
    assert monitor.untimely > 50
    assert monitor.judged < monitor.untimely
    told = [note for note in monitor.notes if "had rows that came later" in note]
    assert len(told) == 1
    assert "an alarm may come late, or not at all" in told[0]


def test_a_model_that_runs_away_is_no_judge(rehearsed, monitor):
    monitor.feed(rehearsed.after[:10_000])
    monitor.observer._spread[:] = 1e-9  # whatever the model shows is far off
    alarms = [monitor.feed(rehearsed.after[k : k + 2000]) for k in range(10_000, 60_000, 2000)]
    assert alarms == [None] * len(alarms)
    assert monitor.state == "astray"
    assert [note for note in monitor.notes if "cannot judge this machine" in note]


def test_a_machine_at_rest_is_waited_for(rehearsed):
    monitor = Monitor(rehearsed.case)
    rows = Shift(rehearsed.config).run(30 * 500)
    assert monitor.feed(rows) is None
    assert monitor.state == "waiting"
    assert monitor.learned == 0.0


def test_a_model_in_place_of_the_config_is_what_the_machine_is_compared_with(rehearsed, tmp_path):
    """A reel that drags: with it in the model the machine is as near as a healthy one, without it is not."""
    drags = set_path(rehearsed.config, "plant.physics.0", {"term": "friction.coulomb", "node": "motor1", "F_C": 3e-3})
    shift = Shift(rehearsed.config).become(drags)
    rows = shift.play(rehearsed.moves, np.random.default_rng(5), 120.0)
    path = tmp_path / "model.yaml"
    path.write_text(yaml.safe_dump(drags.model_dump(mode="json", exclude_unset=True)))
    left = []
    for model in (path, None):
        monitor = Monitor(rehearsed.case, model, seconds=60.0)
        monitor.feed(rows)
        left.append(float(monitor.band.slow_sigma[0]))
    assert left[0] < 0.5 * left[1]
