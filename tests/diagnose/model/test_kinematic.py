from functools import cache

import numpy as np
import pytest
from described_machines import SCREW, case_of, record, rounded

from rtctl.config.errors import NoAnswer
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING

RATE, GAP = 50.0, 3e-5  # of the table, m
FINE = 20  # steps of lost motion a row: it turns between rows
T = np.arange(400 * FINE) / RATE / FINE
WHOLE = 20.0 * np.sin(2 * np.pi * 0.2 * T) + 6.0 * np.sin(2 * np.pi * 0.47 * T)
TURN = WHOLE[::FINE]


def play(turn, gap):
    """What follows a motion (times finer than the rows) with lost motion, at the rows: the play operator."""
    x = 8e-4 * turn
    out, at = [], x[0]
    for value in x:
        at = min(max(at, value - gap / 2), value + gap / 2)
        out.append(at)
    return np.array(out)[::FINE]


@cache
def found(kind):
    way = 8e-4 * TURN
    if kind == "gap":
        way = play(WHOLE, GAP)
    if kind == "ratio":
        way = way + 2e-5 * (np.sin(TURN + 0.7) - np.sin(0.7))
    case = case_of(SCREW, RATE, problem="kinematic", tolerance={"default": 0.05, "joints.nut.ratio": 0.001})
    return diagnose_record(record(case, turn=rounded(TURN, 1e-4), way=rounded(way, 1e-7)))


def test_nothing():
    assert found("none").verdict == NOTHING


def test_lost_motion_of_a_joint_that_is_rigid_in_the_description():
    d = found("gap")
    assert d.verdict == NAMED
    assert [(e.name, e.node) for e in d.effects] == [("transmission.backlash", "nut")]
    assert d.effects[0].parameters["gap"].value == pytest.approx(GAP, rel=0.05)
    assert d.located.channel == "glass"


def test_an_uneven_lead():
    d = found("ratio")  # two positions do not tell whether the lead is uneven or the scale is
    assert d.verdict == AMBIGUOUS
    assert {(e.name, e.node) for e in d.effects} == {("ripple.ratio", "nut"), ("ripple.encoder", "glass")}
    assert d.effects[0].parameters["A"].value == pytest.approx(2e-5, rel=0.1)  # m, of either


def test_values_that_the_program_took_are_not_told():
    d = found("none")
    assert set(d.parameters) <= {"bodies.screw.inertia", "bodies.table.mass", "joints.nut.ratio"}
    from rtctl.diagnose.answer.config import to_config

    assert "stiffness" not in to_config(d.decided.best.model, d.record)["machine"]["joints"]["nut"]


def test_one_position_is_not_enough():
    case = case_of(SCREW, RATE, problem="kinematic")
    with pytest.raises(NoAnswer, match="needs at least two positions"):
        record(case, turn=TURN)
