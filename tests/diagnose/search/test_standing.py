"""Acceptance of a further effect."""

from graph_cases import named

from rtctl.diagnose.search.standing import adds


def with_another(fit, term):
    """Model with a further effect of size zero."""
    return fit._replace(space=fit.space.add(fit.space.hypotheses[0]._replace(term=term)), x=fit.x.copy())


def test_further_effect_needs_a_share_of_the_total_evidence():
    found = named().found
    base, best = found.base, found.best
    more = with_another(best, "drive.offset")

    def merit(brought):
        return lambda f: {id(base): 0.0, id(best): 100.0, id(more): 100.0 + brought}[id(f)]

    assert adds(base, base, best, merit(0.0))
    assert not adds(base, best, more, merit(5.0))
    assert adds(base, best, more, merit(6.0))  # both models have a residual at the noise level


def test_small_further_effect_of_the_same_argument_is_rejected():
    found = named().found
    base, best = found.base, found.best
    more = with_another(best, "friction.viscous")
    merit = {id(base): 0.0, id(best): 100.0, id(more): 150.0}
    assert not adds(base, best, more, lambda f: merit[id(f)])


def test_large_further_effect_needs_less_evidence():
    found = named().found
    base, best = found.base, found.best
    fewer, more = best._replace(e=0.5 * base.e), best._replace(e=0.1 * base.e)

    def merit(brought):
        return lambda f: {id(base): 0.0, id(fewer): 100.0, id(more): 100.0 + brought}[id(f)]

    assert adds(base, fewer, more, merit(4.0))
    assert not adds(base, fewer, more, merit(2.0))  # within chance
