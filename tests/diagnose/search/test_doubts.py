from pathlib import Path

import numpy as np
import pytest
from graph_cases import BELT, RUB, case_of, columns_of, command

from rtctl.case.format2 import read_case
from rtctl.diagnose.evidence.evidence import rivals
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.recording import record_of
from rtctl.diagnose.search.doubts import doubted, no_effect
from rtctl.diagnose.search.search import Found

WEAK = 0.3  # share of the nominal gain
GAIN = "drives.amplifier.gain"


def found_of(machine, terms=()):
    """Base fit of the nominal belt axis to a recording of `machine`."""
    columns = columns_of(case_of(machine), command(0.6), terms)
    like, space = together([record_of(columns, read_case(case_of(BELT), "bundle"), Path("bundle/recording.parquet"))])
    base = refit(like, space)
    return Found(like, base, (), (base,), 3.0)


def weak():
    """Belt axis with 30 % of the nominal amplifier gain."""
    amplifier = dict(BELT["drives"]["amplifier"])
    return {**BELT, "drives": {"amplifier": {**amplifier, "gain": WEAK * float(amplifier["gain"])}}}


def test_gain_far_from_its_nominal_value_is_found():
    found = found_of(weak())
    doubts = doubted(found)
    gain = next(f for f in doubts if f.space.doubted == GAIN)
    assert gain.x[gain.space.names.index(GAIN)] == pytest.approx(np.log(WEAK), abs=0.05)
    first = rivals(found._replace(doubts=doubts))[0]
    assert first.doubted == GAIN
    assert first.unlisted


def test_correct_description_has_no_doubted_parameter():
    assert doubted(found_of(BELT)) == ()


def test_parameter_with_a_corresponding_effect_is_not_doubted():
    assert not any(f.space.doubted.endswith(".dry") for f in doubted(found_of(BELT, [RUB])))
    assert not no_effect("physics.0.k")
    assert no_effect("joints.belt.stiffness")
