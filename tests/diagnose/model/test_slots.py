"""Slots of the compiled simulation: layout of the params, and source of a site."""

import pytest

from rtctl.diagnose.model import slots
from rtctl.idiom import record_dtype
from rtctl.plants.physics import TERMS, anywhere


@pytest.mark.parametrize("term", TERMS.values(), ids=lambda t: t.name)
def test_params_layout_does_not_depend_on_the_values(term):
    """The layout of a slot comes from sample params; all params of a term must have the layout."""
    given = {"node": next(iter(anywhere(term).values()))[-1]}
    for name, info in term.settings.model_fields.items():
        if info.is_required() and name != "node":
            given[name] = slots._inside(info)
    for h in (1e-4, 2e-3):
        assert record_dtype(slots.sample(term)) == record_dtype(term.build(term.settings(**given), h))


def test_site_without_terms_has_one_comparison():
    text = slots.at_site("command", "described", ())
    assert "kind == 0" in text and text.count("kind ==") == 1
