from graph_cases import BELT, RUB, case_of, command, named, record
from marks import full

from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.search.search import ALIKE, apart, likeness

OFFSET = {"term": "drive.offset", "node": "amplifier", "offset": 0.03}


@full
def test_two_effects_are_found_together():
    found = diagnose_record(record(case_of(BELT), command(0.6), [RUB, OFFSET])).found
    assert "friction.coulomb:carriage" in found.best.names
    assert len(found.best.names) == 2
    pairs = {frozenset(f.names): found.merit(f) for f in found.fits}
    assert pairs[frozenset(("friction.coulomb:carriage", "drive.offset:amplifier"))] > found.merit(found.best) - 2.0


def test_equivalent_models_are_extended_once():
    found = named().found
    best, base = found.best, found.base
    assert likeness(base, best, best) > ALIKE
    assert apart(base, [best, best._replace(x=best.x.copy())], 4) == [best]
