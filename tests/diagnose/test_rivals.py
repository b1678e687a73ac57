"""What could stand in the place of a term that was found."""

import pytest

from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.name import names
from rtctl.diagnose.rework import polish
from rtctl.diagnose.rivals import rivals


def test_rivals_stand_in_the_place_of_the_term_and_do_worse(tilted, searched):
    problem, base, looked = searched(tilted)
    found = polish(problem, looked.rounds[0][0])
    among = ("drive.offset", "drive.gain_asymmetry", "load.spring", "friction.asymmetry")
    candidates = hypotheses(tilted.record, base.model.base, only=among)
    others = rivals(problem, found, 0, candidates, ("load.spring",), most=2)
    assert others
    assert all(names(f) != names(found) and len(f.space.hypotheses) == 1 for f in others)
    assert [f.merit for f in others] == sorted(f.merit for f in others)
    assert others[0].merit == pytest.approx(found.merit, rel=0.01)  # a constant push and tilted friction: one law
    assert all(f.merit > 2.0 * found.merit for f in others[1:])
    assert "load.spring:carriage" in {names(f)[0] for f in others}  # asked for, however bad it looks
