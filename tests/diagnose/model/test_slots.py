"""Slots of the compiled simulation: the layout of their params, and the text of a site."""

import pytest

from rtctl.diagnose.model import slots
from rtctl.idiom import record_dtype
from rtctl.plants.physics import TERMS, anywhere


@pytest.mark.parametrize("term", TERMS.values(), ids=lambda t: t.name)
def test_sample_params_have_the_layout_of_any_other(term):
    """A slot is laid out from a sample: a term whose layout hangs on its values would not fit in it."""
    given = {"node": next(iter(anywhere(term).values()))[-1]}
    for name, info in term.settings.model_fields.items():
        if info.is_required() and name != "node":
            given[name] = slots._inside(info)
    for h in (1e-4, 2e-3):
        assert record_dtype(slots.sample(term)) == record_dtype(term.build(term.settings(**given), h))


def test_a_site_without_a_term_asks_for_no_number():
    text = slots.at_site("command", "described", ())
    assert "kind == 0" in text and text.count("kind ==") == 1
