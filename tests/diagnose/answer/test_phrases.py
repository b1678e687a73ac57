from rtctl.plants.physics import TERMS


def test_every_term_of_the_library_has_a_phrase():
    assert all(term.phrase for term in TERMS.values())
