"""A description whose numbers are all exact: no parameter is fitted beside the effects."""

import pytest
from described_machines import rotor

from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NOTHING

EXACT = {"default": 0.0}


def test_nothing_is_missing():
    d = diagnose_record(rotor(1, 0, dry=0.0, tolerance=EXACT))
    assert d.verdict == NOTHING
    assert d.parameters == {}


def test_what_rubs_in_one_direction_is_a_constant_force():
    d = diagnose_record(rotor(1, 0, dry=0.03, tolerance=EXACT))
    assert d.verdict == AMBIGUOUS  # the rotor never turns back
    assert {e.name for e in d.effects} == {"friction.coulomb", "drive.offset"}
    friction = next(e for e in d.effects if e.name == "friction.coulomb")
    assert friction.parameters["F_C"].value == pytest.approx(0.03, rel=0.05)
