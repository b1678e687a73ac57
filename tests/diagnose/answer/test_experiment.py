"""Separating experiment: two friction laws that are equivalent at one speed, and a motion that separates them."""

from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from described_machines import ROTOR, case_of

from rtctl import machines
from rtctl.case.format2 import read_case
from rtctl.diagnose.answer import experiment, files
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.answer.report import instead
from rtctl.diagnose.evidence.diagnosis import NAMED
from rtctl.diagnose.evidence.evidence import Rival
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import nominal, settings_of
from rtctl.diagnose.model.recording import GraphRecord, record_of
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.hypotheses import hypotheses

RATE, SPEED = 500.0, 3.0  # Hz, rad/s
DRY = {"term": "friction.coulomb", "node": "rotor", "F_C": 5e-3}
CASE = case_of(ROTOR, RATE)


def recorded(ref, name, *terms):
    """Record of a rotor with the extra `terms` that follows `ref` (n,), rad."""
    n, case = len(ref), read_case(CASE, name)
    still = np.zeros(n)
    y, grain = {"encoder": still}, {"encoder": 1 / 1592.0}
    blank = GraphRecord(case, still, 1.0 / RATE, ref, still, still[:, None], y, grain, None)
    model = nominal(case).add(*map(settings_of, terms))
    out, u = loop.run(Simulator(blank), loop_of(blank), model, ref, still)
    columns = {"t": np.arange(n) / RATE, "tau": u[:, 0], "counts": np.floor(1592.0 * out[:, 0])}
    return record_of(columns, case, Path(name) / "recording.parquet")


def one_speed(seconds=4.0):
    """Reference (n,) in rad of a rotation at constant speed."""
    t = np.arange(round(seconds * RATE)) / RATE
    return SPEED * (t - 0.1 * (1.0 - np.exp(-t / 0.1)))


@cache
def rivals():
    """Record at constant speed, where every friction law is a constant torque, and fits of two laws."""
    record = recorded(one_speed(), "first", DRY)
    like, space = together([record])
    found = hypotheses(like.sim, nominal(record.case))
    laws = [next(h for h in found if h.term == term) for term in ("friction.coulomb", "friction.viscous")]
    return record, [refit(like, space.add(law)) for law in laws]


@cache
def plan():
    """Planned experiment for two equally probable laws."""
    record, fits = rivals()
    table = tuple(Rival(f, None, 0.0, 0.5) for f in fits)
    decided = SimpleNamespace(best=fits[0], table=table, probabilities=tuple((f.names, 0.5) for f in fits))
    return experiment.planned(record, decided)


@cache
def both():
    """Joint diagnosis of the first recording and the experiment."""
    motion = plan().experiment.motion
    t = np.arange(round(motion.seconds * RATE)) / RATE
    second = recorded(motion.reference(t), "second", DRY)
    return diagnose_record(rivals()[0], second)


def test_planned_motion_separates_laws_that_are_equivalent_at_one_speed():
    _, fits = rivals()
    assert abs(fits[0].power * (fits[0].loss - fits[1].loss)) < experiment.CLEAR
    found = plan().experiment
    assert found.rivals == ("friction.coulomb:rotor", "friction.viscous:rotor")
    assert found.nats[found.name] > experiment.CLEAR
    assert found.nats[found.name] >= 0.9 * max(found.nats.values())
    assert plan().untold == ""


@pytest.mark.long
def test_joint_diagnosis_with_the_experiment_names_the_law():
    d = both()
    assert d.verdict == NAMED
    assert [e.name for e in d.effects] == [DRY["term"]]


def test_experiment_appears_in_json_and_report_and_as_a_valid_config():
    d = both()._replace(planned=plan())
    told = d.as_json()["separating_experiment"]
    assert told["why"]["rivals"] == list(plan().experiment.rivals)
    assert told["why"]["nats"][told["name"]] > experiment.CLEAR
    assert any("rtctl run experiment.yaml" in line for line in instead(d))
    settings = machines.settings(yaml.safe_load(files.experiment_yaml(d)))
    assert settings.loop.mode == "fused"
    assert len(settings.reference.knots) == len(plan().experiment.motion.knots)
    assert settings.law.position.gain == pytest.approx(30.0**2 * 1e-3)


def test_identical_rivals_have_no_separating_experiment():
    record, fits = rivals()
    found = experiment.design(record, [fits[0], fits[0]], fits[0])
    assert max(found.nats.values()) == pytest.approx(0.0, abs=1e-9)
    table = tuple(Rival(f, None, 0.0, 0.5) for f in fits[:1])
    alone = SimpleNamespace(best=fits[0], table=table, probabilities=((fits[0].names, 1.0),))
    assert experiment.planned(record, alone) == experiment.Planned()
