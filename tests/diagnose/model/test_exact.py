"""Descriptions with exact parameters: only effects are fitted."""

import pytest
from described_machines import rotor

from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NOTHING

EXACT = {"default": 0.0}


def test_exact_nominal_machine_has_the_verdict_nothing():
    d = diagnose_record(rotor(1, 0, dry=0.0, tolerance=EXACT))
    assert d.verdict == NOTHING
    assert d.parameters == {}


def test_friction_in_one_direction_is_ambiguous_with_an_offset():
    d = diagnose_record(rotor(1, 0, dry=0.03, tolerance=EXACT))
    assert d.verdict == AMBIGUOUS  # the rotor never reverses
    assert {e.name for e in d.effects} == {"friction.coulomb", "drive.offset"}
    friction = next(e for e in d.effects if e.name == "friction.coulomb")
    assert friction.parameters["F_C"].value == pytest.approx(0.03, rel=0.05)
