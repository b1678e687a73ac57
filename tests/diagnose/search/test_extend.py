from graph_cases import named

from rtctl.diagnose.search.extend import Promise, extended, in_turns, key, screened, terms_of


def promise(gain, power):
    """Promise with gain and power only."""
    return Promise(None, None, None, gain, power)


def test_candidates_alternate_between_gain_and_power():
    one, two, three = promise(9.0, 1.0), promise(5.0, 2.0), promise(1.0, 8.0)
    assert in_turns([two, three, one])[:2] == [one, three]
    assert len(in_turns([one, two, three])) == 3


def test_most_promising_effect_is_fitted_beside_a_model():
    found = named().found
    merit = found.merit
    known = {}
    fits = extended(found.like, [found.base], known, 2, merit, None)
    assert all(known[key(f.names)] is f for f in fits)
    assert max(fits, key=merit).names == ("friction.coulomb:carriage",)


def test_model_is_not_extended_by_its_own_effects():
    best = named().found.best
    assert not set(best.names) & {score.hypothesis.name for score in screened(best).scores}


def test_look_alike_is_always_fitted():
    found = named().found
    plain = {h.term for f in extended(found.like, [found.base], {}, 1, found.merit) for h in f.space.hypotheses}
    alike = extended(found.like, [found.base], {}, 1, found.merit, None, ("drive.deadband",))
    assert {h.term for f in alike for h in f.space.hypotheses} == plain | {"drive.deadband"}
    assert "drive.deadband" not in plain


def test_second_pass_tries_only_new_terms():
    found = named().found
    tried = extended(found.like, [found.base], {}, 1, found.merit)
    more = extended(found.like, [found.base], {}, 1, found.merit, passed=[f.names for f in tried])
    assert more
    assert {terms_of(f.names) for f in tried}.isdisjoint(terms_of(f.names) for f in more)
    beside = extended(found.like, [found.best], {}, 1, found.merit)
    assert not extended(found.like, [found.best], {}, 1, found.merit, passed=[f.names for f in beside])
