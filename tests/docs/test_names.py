"""What the pages on diagnosis call by its file or name is there, under that name."""

import importlib
import re

import pytest
from manual_blocks import ROOT

PACKAGE = ROOT / "rtctl" / "diagnose"
PAGES = ("docs/diagnosis.md", "docs/decisions/0006-diagnosis.md", "docs/proof.md", "docs/proof_earlier.md")


def missing(text: str) -> list[str]:
    """Files and names of the package that a page tells of and that are not there."""
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    files = re.findall(r"`(\w+)\.py`", text)
    told = re.findall(r"`(\w+)\.(?!py`|json`|yaml`)(\w+)`", text)
    names = [(module, name) for module, name in told if module in modules]
    wrong = [f"{file}.py" for file in files if file not in modules]
    there = {module: importlib.import_module(f"rtctl.diagnose.{module}") for module, _ in names}
    return wrong + [f"{module}.{name}" for module, name in names if not hasattr(there[module], name)]


@pytest.mark.parametrize("page", PAGES)
def test_names(page):
    assert missing((ROOT / page).read_text()) == []


def test_a_name_that_is_gone_is_found():
    assert missing("`nowhere.py` `edges.py` `fit.FLOOR` `decide.FORM`") == ["nowhere.py", "fit.FLOOR"]
