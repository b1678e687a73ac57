"""Monitor: no alarm on a healthy machine, alarm on a new effect, notes on faults of the row stream."""

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


def test_healthy_machine_raises_no_alarm(rehearsed, monitor):
    assert monitor.state == "waiting"
    assert monitor.feed(rehearsed.after) is None
    assert monitor.state == "watching"
    assert monitor.judged > 50
    assert monitor.notes == []


def test_monitor_does_not_depend_on_the_piece_size(rehearsed):
    one, many = (Monitor(rehearsed.case, band=rehearsed.band) for _ in range(2))
    one.feed(rehearsed.after)
    at = 0
    for size in np.random.default_rng(0).integers(1, 3000, 1000):
        many.feed(rehearsed.after[at : at + size])
        at += size
    assert many.judged == one.judged
    np.testing.assert_allclose(many.sums.value, one.sums.value, atol=1e-9)


def test_new_stick_slip_of_a_drive_is_detected_within_30_s_of_motion(rehearsed, monitor):
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


def test_lost_rows_give_a_note_and_no_alarm(rehearsed, monitor):
    rows = rehearsed.after
    assert monitor.feed(rows[:20_000]) is None
    assert monitor.feed(rows[21_000:40_000]) is None
    assert monitor.lost == 1000
    assert [note for note in monitor.notes if note.startswith("1000 rows did not come")]
    assert monitor.feed(rows[45_000:], lost=5000) is None
    assert monitor.lost == 6000


def test_clock_jump_gives_a_note_and_no_alarm(rehearsed, monitor):
    rows = rehearsed.after.copy()
    rows["t"][30_000:] += 3600.0
    assert monitor.feed(rows) is None
    assert [note for note in monitor.notes if "clock of the rows jumped by +3.6e+03 s" in note]


def test_machine_restart_gives_a_note_and_no_alarm(rehearsed, monitor):
    assert monitor.feed(rehearsed.after[:30_000]) is None
    again = Shift(rehearsed.config).play(rehearsed.moves, np.random.default_rng(6), 30.0)
    assert monitor.feed(again) is None
    assert [note for note in monitor.notes if "started anew" in note]


def test_windows_with_late_rows_are_not_scored(rehearsed, monitor):
    rows = rehearsed.after.copy()
    late = np.random.default_rng(7).random(len(rows)) < 0.01
    rows["t"][late] += 0.5 / 500.0
    assert monitor.feed(rows) is None
    assert monitor.untimely > 50
    assert monitor.judged < monitor.untimely
    told = [note for note in monitor.notes if "had rows that came later" in note]
    assert len(told) == 1
    assert "an alarm may come late, or not at all" in told[0]


def test_divergent_model_raises_no_alarm(rehearsed, monitor):
    monitor.feed(rehearsed.after[:10_000])
    monitor.observer._spread[:] = 1e-9  # every model error exceeds the divergence limit
    alarms = [monitor.feed(rehearsed.after[k : k + 2000]) for k in range(10_000, 60_000, 2000)]
    assert alarms == [None] * len(alarms)
    assert monitor.state == "astray"
    assert [note for note in monitor.notes if "cannot judge this machine" in note]


def test_machine_at_rest_keeps_the_monitor_waiting(rehearsed):
    monitor = Monitor(rehearsed.case)
    rows = Shift(rehearsed.config).run(30 * 500)
    assert monitor.feed(rows) is None
    assert monitor.state == "waiting"
    assert monitor.learned == 0.0


def test_model_file_replaces_the_config_as_reference(rehearsed, tmp_path):
    """Dry friction of a reel in the model file lowers the slow residual."""
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
