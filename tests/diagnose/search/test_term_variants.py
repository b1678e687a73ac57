"""Richer forms of the terms."""

from rtctl.plants.physics import TERMS

EXTRAS = {name for name, term in TERMS.items() if term.richer}


def test_terms_with_richer_forms_are_searched():
    assert EXTRAS
    assert all(TERMS[name].search for name in EXTRAS)
