"""Other forms of a hypothesis keep what they are forms of."""

from rtctl.plants.physics import TERMS

EXTRAS = {name for name, term in TERMS.items() if term.richer}
HINTS = {"order": [7.0], "wavelength": [0.02]}


def test_extras_belong_to_a_form_that_is_searched_for():
    assert EXTRAS
    assert all(TERMS[name].search for name in EXTRAS)
