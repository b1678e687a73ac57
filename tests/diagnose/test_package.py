"""Folders of the diagnosis: documented content, imports in one direction."""

import ast
from pathlib import Path

import pytest

import rtctl.diagnose

HERE = Path(rtctl.diagnose.__file__).parent
BELOW = {"calibration"}  # constants that every folder may import
FLOORS = (
    "record",
    "model",
    "likelihood",
    "search",
    "evidence",
    "answer",
)  # each folder imports only from earlier folders
BEGINNING = "rtctl.diagnose."


def imported(path):
    """Folders of the diagnosis that a module imports from, at any level."""
    out = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(BEGINNING):
            out.add(str(node.module).split(".")[2])
    return out


def test_package_docstring_lists_the_folders():
    assert {p.name for p in HERE.iterdir() if p.is_dir() and p.name != "__pycache__"} == set(FLOORS)
    assert all(f"    {name}" in (rtctl.diagnose.__doc__ or "") for name in FLOORS)


@pytest.mark.parametrize("floor", FLOORS)
def test_folder_has_a_docstring(floor):
    doc = ast.get_docstring(ast.parse((HERE / floor / "__init__.py").read_text("utf-8")))
    assert doc is not None
    assert len(doc) > 40


@pytest.mark.parametrize("floor", FLOORS)
def test_imports_between_folders_have_one_direction(floor):
    above = set(FLOORS[FLOORS.index(floor) + 1 :]) | {p.stem for p in HERE.glob("*.py")} - BELOW
    found = {path.name: imported(path) & above for path in (HERE / floor).glob("*.py")}
    assert {name: others for name, others in found.items() if others} == {}
