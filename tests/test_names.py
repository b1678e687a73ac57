"""No code compares with the name of a term or of a machine; such properties are declared in one file each."""

import ast
from pathlib import Path

import pytest

from rtctl.plants.physics import TERMS

ROOT = Path(__file__).parents[1] / "rtctl"
BY_NAME = ("reproduce", "proof", "own/templates")  # published results, independent equations, and what a user writes
MACHINES = {"ivu", "ldu", "axis"}
DECLARED = tuple(f"rtctl/machines/{name}" for name in MACHINES) + tuple(f"plants/{name}.py" for name in MACHINES)
ALLOWED = (*DECLARED, "rtctl/reproduce/", "rtctl/proof/")
LOOKS_UP = ("get", "pop", "setdefault", "startswith", "endswith", "removeprefix")
FAMILIES = {name.partition(".")[0] for name in TERMS}


def told(text: str) -> list[str]:
    """Term names (with or without a parameter) and their prefixes among the strings of a module."""
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
def test_term_name_is_found_in_any_expression(text):
    assert told(text)
    assert not told('"""The term drive.lag comes late."""')


def words(node: ast.AST) -> set[str]:
    """Texts of a constant, of the items of a list and of the keys of a table."""
    if isinstance(node, ast.Constant):
        return {node.value} if isinstance(node.value, str) else set()
    inner = node.keys if isinstance(node, ast.Dict) else getattr(node, "elts", [])
    return {word for item in inner if item is not None for word in words(item)}


def asked(node: ast.AST) -> list[ast.AST]:
    """Nodes that are compared, looked up or used as keys."""
    if isinstance(node, ast.Compare):
        return [node.left, *node.comparators]
    if isinstance(node, ast.Dict):
        return [node]
    if isinstance(node, ast.MatchValue):
        return [node.value]
    if isinstance(node, ast.Subscript) and getattr(node.value, "id", "") != "Literal":
        return [node.slice]
    if isinstance(node, ast.Call) and getattr(node.func, "attr", "") in LOOKS_UP:
        return list(node.args[:1])
    return []


def by_machine(text: str) -> list[int]:
    """Lines of a module that compare with the name of a machine."""
    return [
        getattr(node, "lineno", getattr(getattr(node, "pattern", None), "lineno", 0))
        for node in ast.walk(ast.parse(text))
        if any(MACHINES & words(part) for part in asked(node))
    ]


def test_no_module_compares_with_the_name_of_a_machine():
    found = {}
    for folder in ("rtctl", "plants", "drivers"):
        for path in sorted((ROOT.parent / folder).rglob("*.py")):
            where = path.relative_to(ROOT.parent).as_posix()
            if not where.startswith(ALLOWED) and (lines := by_machine(path.read_text("utf-8"))):
                found[where] = lines
    assert found == {}


@pytest.mark.parametrize(
    "text",
    ['kind == "ivu"', 'kind not in ("ldu", "axis")', '{"ivu": 1}[kind]', 'table["ldu"]', 'table.get("axis")',
     'kind in {"axis": 1}', 'match kind:\n    case "ivu": pass'],
)  # fmt: skip
def test_comparison_with_a_machine_name_is_found(text):
    assert by_machine(text)


@pytest.mark.parametrize("text", ['"""ivu == ldu"""', 'machine: Literal["ivu"] = "ivu"', 'load("ivu")'])
def test_machine_name_may_be_a_value(text):
    assert not by_machine(text)
