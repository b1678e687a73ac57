"""The experiment to run next: laws that look alike at one speed, told apart by the motion that is chosen."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from machines import ROTOR, case_of

from rtctl import machines
from rtctl.diagnose.diagnosis import NAMED
from rtctl.diagnose.graph import experiment, files, loop
from rtctl.diagnose.graph.answer import diagnose_record
from rtctl.diagnose.graph.case import read_case
from rtctl.diagnose.graph.model import nominal, settings_of
from rtctl.diagnose.graph.record import GraphRecord, record_of
from rtctl.diagnose.graph.report import instead
from rtctl.diagnose.graph.simulate import Simulator

RATE, SPEED = 500.0, 3.0  # Hz, rad/s
DRY = {"term": "friction.coulomb", "node": "rotor", "F_C": 5e-3}
CASE = case_of(ROTOR, RATE)


def recorded(ref, name, *terms):
    """The record of a rotor with `terms` beyond its description that follows `ref` (n,), rad."""
    n, case = len(ref), read_case(CASE, name)
    still = np.zeros(n)
    y, grain = {"encoder": still}, {"encoder": 1 / 1592.0}
    blank = GraphRecord(case, still, 1.0 / RATE, ref, still, still[:, None], y, grain, None)
    model = nominal(case).add(*map(settings_of, terms))
    out, u = loop.run(Simulator(blank), loop.loop_of(blank), model, ref, still)
    columns = {"t": np.arange(n) / RATE, "tau": u[:, 0], "counts": np.floor(1592.0 * out[:, 0])}
    return record_of(columns, case, Path(name) / "recording.parquet")


def one_speed(seconds=4.0):
    """Reference (n,) that turns one way at one speed."""
    t = np.arange(round(seconds * RATE)) / RATE
    return SPEED * (t - 0.1 * (1.0 - np.exp(-t / 0.1)))


@cache
def first():
    """Record and diagnosis of a turn at one speed, at which friction of any law is one torque."""
    record = recorded(one_speed(), "first", DRY)
    return record, diagnose_record(record)


def test_laws_that_look_alike_at_one_speed_leave_an_experiment():
    _, d = first()
    assert d.verdict != NAMED
    found = d.planned.experiment
    assert found is not None
    assert len(found.rivals) >= 2
    assert found.nats[found.name] > experiment.CLEAR
    data = d.as_json()["separating_experiment"]
    assert data["why"]["nats"][found.name] == max(data["why"]["nats"].values()) or found.motion.seconds
    assert any("rtctl run experiment.yaml" in line for line in instead(d))


def test_the_experiment_names_the_law():
    record, d = first()
    motion = d.planned.experiment.motion
    t = np.arange(round(motion.seconds * RATE)) / RATE
    again = diagnose_record(record, recorded(motion.reference(t), "second", DRY))
    assert again.verdict == NAMED
    assert [e.name for e in again.effects] == [DRY["term"]]


def test_the_file_of_a_recording_by_others_has_a_law_that_stands_in():
    _, d = first()
    settings = machines.settings(yaml.safe_load(files.experiment_yaml(d)))
    assert settings.loop.mode == "fused"
    assert len(settings.reference.knots) == len(d.planned.experiment.motion.knots)
    assert settings.law.position.gain == pytest.approx(30.0**2 * 1e-3)


def test_equal_rivals_are_told_by_no_motion():
    record, d = first()
    best = d.decided.best
    twice = d.decided._replace(probabilities=((("a:b",), 0.5), (("c:d",), 0.5)), table=())
    assert experiment.left(twice._replace(probabilities=())) == ()
    found = experiment.design(record, [best, best], best)
    assert max(found.nats.values()) == pytest.approx(0.0, abs=1e-9)
