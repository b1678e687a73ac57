"""Search coordinates of the terms: complete, and existing settings."""

import pytest

from rtctl.plants.physics import TERMS
from rtctl.plants.physics.search import At, Turn

SEARCH = {name: term.search for name, term in TERMS.items() if term.search and any(s.offered for s in term.stands)}


def names(parts):
    out = []
    for part in parts:
        out += [part.amplitude, part.phase] if isinstance(part, Turn) else [part.name]
        out += [part.width] if isinstance(part, At) else []
    return out


@pytest.mark.parametrize("term", SEARCH)
def test_search_coordinates_are_settings_of_the_term(term):
    fields = TERMS[term].settings.model_fields
    for name in names((*SEARCH[term], *TERMS[term].richer, *TERMS[term].sliding)):
        assert name in fields, f"{term} has no {name}"
    given = set(names(SEARCH[term]))
    needed = {name for name, info in fields.items() if info.is_required() and name != "node"}
    assert needed <= given
