"""No code outside the library of terms speaks of a term by its name: what is told about one stands in its own file."""

import ast
from pathlib import Path

import pytest

from rtctl.plants.physics import TERMS

ROOT = Path(__file__).parents[1] / "rtctl"
BY_NAME = ("reproduce", "proof", "own/templates")  # published results, independent equations, and what a user writes
FAMILIES = {name.partition(".")[0] for name in TERMS}


def told(text: str) -> list[str]:
    """Names of terms, with or without a parameter, and beginnings of them, among the strings of a module."""
    strings = [n.value for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
    beginnings = {f"{family}." for family in FAMILIES}
    return [s for s in strings if s in TERMS or s.rpartition(".")[0] in TERMS or s in beginnings]


def test_no_module_compares_with_the_name_of_a_term():
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        where = path.relative_to(ROOT).as_posix()
        if not where.startswith(BY_NAME) and (names := told(path.read_text())):
            found[where] = names
    assert found == {}


@pytest.mark.parametrize(
    "text", ['x == "drive.lag"', '{"drive.lag": 1}', 'x.startswith("ripple.")', '"transmission.creep.kappa"']
)
def test_a_name_is_seen_wherever_it_stands(text):
    assert told(text)
    assert not told('"""The term drive.lag comes late."""')
