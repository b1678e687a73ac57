from graph_cases import named

from rtctl.diagnose.search.enrich import richer
from rtctl.diagnose.search.hypotheses import hypotheses


def plain(term):
    """Base fit of a belt axis and the hypotheses of a term."""
    base = named().found.base
    return base, [h for h in hypotheses(base.like.parts[0].sim, base.model) if h.term == term]


def test_ripple_of_order_two_is_enriched_as_a_harmonic_of_order_one():
    base, found = plain("ripple.ratio")
    twice = next(h for h in found if h.fixed["order"] == 2.0)
    assert sorted(h.fixed["order"] for h in richer(base, twice)) == [1.0, 2.0]
    assert all({"A2|phi2", "A3|phi3"} <= {c.name for c in h.coordinates} for h in richer(base, twice))


def test_lag_of_either_order_is_enriched_to_a_damped_second_order():
    base, found = plain("drive.lag")
    assert {h.fixed["order"] for h in found} == {1, 2}
    for h in found:
        (rich,) = richer(base, h)
        assert rich.fixed["order"] == 2 and [c.name for c in rich.coordinates] == ["tau", "zeta"]
