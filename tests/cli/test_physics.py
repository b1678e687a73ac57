import pytest

from rtctl.plants.physics import TERMS


def test_lists_every_term(rtctl):
    code, out, _ = rtctl("physics")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(TERMS)


@pytest.mark.parametrize("name", TERMS)
def test_explains_a_term(rtctl, name):
    code, out, _ = rtctl("physics", name)
    term, said = TERMS[name], " ".join(out.split())
    assert code == 0
    for text in (term.words, term.equation, term.source, *term.nodes, *term.look_alikes.values()):
        assert " ".join(text.split()) in said
    for parameter in set(term.settings.model_fields) - {"term", "node"}:
        assert f"{parameter} " in out


@pytest.mark.parametrize("wrong", ["friction.stribek", "stribeck"])
def test_an_unknown_term(rtctl, wrong):
    code, out, err = rtctl("physics", wrong)
    assert (code, out) == (2, "")
    assert "did you mean 'friction.stribeck'?" in err
