from functools import cache

import numpy as np
import pytest
from described_machines import SCREW, case_of, record, rounded

from rtctl.config.errors import NoAnswer
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING

RATE, GAP = 50.0, 3e-5  # Hz; m of the table
FINE = 20  # steps of lost motion per row: reversals between rows
T = np.arange(400 * FINE) / RATE / FINE
WHOLE = 20.0 * np.sin(2 * np.pi * 0.2 * T) + 6.0 * np.sin(2 * np.pi * 0.47 * T)
TURN = WHOLE[::FINE]


def behind_backlash(turn, gap):
    """Table position (rows,) behind backlash: the play operator on a motion with FINE steps per row."""
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
        way = behind_backlash(WHOLE, GAP)
    if kind == "ratio":
        way = way + 2e-5 * (np.sin(TURN + 0.7) - np.sin(0.7))
    case = case_of(SCREW, RATE, problem="kinematic", tolerance={"default": 0.05, "joints.nut.ratio": 0.001})
    return diagnose_record(record(case, turn=rounded(TURN, 1e-4), way=rounded(way, 1e-7)))


def test_nominal_nut_has_the_verdict_nothing():
    assert found("none").verdict == NOTHING


@pytest.mark.long
def test_backlash_of_a_rigid_nut_is_named():
    d = found("gap")
    assert d.verdict == NAMED
    assert [(e.name, e.node) for e in d.effects] == [("transmission.backlash", "nut")]
    assert d.effects[0].parameters["gap"].value == pytest.approx(GAP, rel=0.05)
    assert d.located.channel == "glass"


@pytest.mark.long
def test_periodic_lead_error_is_ambiguous_with_a_scale_error():
    d = found("ratio")  # two positions do not separate the lead from the scale
    assert d.verdict == AMBIGUOUS
    assert {(e.name, e.node) for e in d.effects} == {("ripple.ratio", "nut"), ("ripple.encoder", "glass")}
    assert d.effects[0].parameters["A"].value == pytest.approx(2e-5, rel=0.1)  # m, of either


def test_assumed_stiffness_is_not_reported():
    d = found("none")
    assert set(d.parameters) <= {"bodies.screw.inertia", "bodies.table.mass", "joints.nut.ratio"}
    from rtctl.diagnose.answer.config import to_config

    assert "stiffness" not in to_config(d.decided.best.model, d.record)["machine"]["joints"]["nut"]


def test_kinematic_problem_needs_two_positions():
    case = case_of(SCREW, RATE, problem="kinematic")
    with pytest.raises(NoAnswer, match="needs at least two positions"):
        record(case, turn=TURN)
