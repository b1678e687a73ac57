"""User term in the library of effects: fits and diagnosis."""

import ast

import pytest
from rtctl_config import TEMPLATES

from rtctl.config.errors import UserError
from rtctl.diagnose.model import kernel
from rtctl.diagnose.search.grid_starts import Size, parts_of
from rtctl.own.files import OwnError, Source, trust
from rtctl.own.term import own_term, register, register_file, sizes, texts
from rtctl.plants.physics import TERMS

SPEC = "./my_term.py:MyTerm"
TEXT = (TEMPLATES / "my_term.py").read_text()


def source(text=TEXT):
    trust([text])
    return Source("./my_term.py", "MyTerm", text)


def test_registered_user_term_is_a_library_term(tmp_path):
    (tmp_path / "my_term.py").write_text(TEXT)
    register_file(SPEC, tmp_path)
    term = TERMS[SPEC]
    assert term.name == SPEC and not term.tabled
    assert term.settings(node="reel1", c=1e-4).term == SPEC
    assert texts([SPEC, "friction.viscous"]) == {"./my_term.py": TEXT}


def test_fit_starts_at_the_typical_value_of_a_user_term():
    register([source()])
    assert sizes(SPEC) == {"c": (1e-6, 1e-3)} and sizes("friction.viscous") == {}
    (part,) = parts_of(SPEC)
    assert isinstance(part, Size) and (part.name, part.measure) == ("c", "one")
    assert part.share == pytest.approx((1e-6 * 1e-3) ** 0.5)


def test_kernel_of_the_fits_includes_a_user_term():
    before = kernel.source()
    register([source()])
    after = kernel.source()
    module = source().module
    assert module not in before
    assert f"import {module}" in after.splitlines()
    assert f"{module}.drag(t.q[k].__my_term_py_MyTerm, " in after
    ast.parse(after)


def test_invalid_range_of_a_user_term_is_refused():
    with pytest.raises(OwnError, match=r"MY_TERM\.typical: c: \(0, 1\) should be a setting's lowest and highest size"):
        own_term(source(TEXT.replace("(1e-6, 1e-3)", "(0.0, 1.0)")))


def test_invalid_term_option_is_refused():
    from rtctl.cli.diagnose import _register

    with pytest.raises(UserError, match=r"--term \./none\.py:None: \./none\.py: no such file"):
        _register(["./none.py:None"])
