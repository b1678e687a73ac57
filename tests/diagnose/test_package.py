"""The folders of the diagnosis: each says what may live there, and data flow through them one way."""

import ast
from pathlib import Path

import pytest

import rtctl.diagnose

HERE = Path(rtctl.diagnose.__file__).parent
BELOW = {"calibration"}  # numbers, which all may read
FLOORS = ("record", "model", "likelihood", "search", "evidence", "answer")  # each imports from those before it
BEGINNING = "rtctl.diagnose."


def imported(path):
    """Folders of the diagnosis that a module imports from, anywhere in it."""
    out = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(BEGINNING):
            out.add(str(node.module).split(".")[2])
    return out


def test_folders_are_those_of_the_map():
    assert {p.name for p in HERE.iterdir() if p.is_dir() and p.name != "__pycache__"} == set(FLOORS)
    assert all(f"    {name}" in (rtctl.diagnose.__doc__ or "") for name in FLOORS)


@pytest.mark.parametrize("floor", FLOORS)
def test_a_folder_says_what_may_live_there(floor):
    doc = ast.get_docstring(ast.parse((HERE / floor / "__init__.py").read_text("utf-8")))
    assert doc is not None
    assert len(doc) > 40


@pytest.mark.parametrize("floor", FLOORS)
def test_data_flow_one_way(floor):
    above = set(FLOORS[FLOORS.index(floor) + 1 :]) | {p.stem for p in HERE.glob("*.py")} - BELOW
    found = {path.name: imported(path) & above for path in (HERE / floor).glob("*.py")}
    assert {name: others for name, others in found.items() if others} == {}
