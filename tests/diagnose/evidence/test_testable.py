"""Names that a recording cannot test are never sure."""

import numpy as np
from graph_cases import named, nothing

from rtctl.diagnose.calibration import SEEN, UNTESTED
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS
from rtctl.diagnose.evidence.testable import untestable, without_untestable
from rtctl.diagnose.evidence.verdict import of_motion
from rtctl.diagnose.model.space import SIZE, Coordinate, Hypothesis

RUB = "friction.coulomb:carriage"


def blind(found, name):
    """What was found, by a recording in which a typical size of one effect would not show."""
    scores = (s._replace(norm=0.5 * SEEN) if s.hypothesis.name == name else s for s in found.scores)
    return found._replace(scores=tuple(scores))


def test_an_effect_of_which_a_typical_size_shows_can_be_tested():
    found = named().found
    assert RUB not in untestable(found)
    assert untestable(blind(found, RUB)) == untestable(found) | {RUB}
    assert named().cannot_test == tuple(sorted(untestable(found)))


def test_a_name_that_cannot_be_tested_is_not_sure():
    decided = of_motion(blind(named().found, RUB))
    assert decided.verdict == AMBIGUOUS
    assert decided.best.names == (RUB,)
    assert decided.confidence == (UNTESTED,)


def test_it_goes_where_the_others_take_off_what_is_missing():
    found = named().found
    offset = Hypothesis("drive.offset", "amplifier", (Coordinate("offset", SIZE, 0.03),))
    space, n = found.best.space.add(offset), found.best.space.nb + 1
    both = found.best._replace(space=space, x=np.insert(found.best.x, n, 0.0))
    assert without_untestable(found, both, frozenset({offset.name})).names == (RUB,)
    assert without_untestable(found, both, frozenset({RUB})).names == both.names  # offset alone explains nothing
    assert without_untestable(found, both, frozenset()) is both


def test_a_model_without_names_stays():
    found = nothing().found
    assert without_untestable(found, found.base, frozenset({RUB})) is found.base
