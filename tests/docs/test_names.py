"""Files and names in the pages on diagnosis exist in the package."""

import importlib
import re

import pytest
from manual_blocks import ROOT

PACKAGE = ROOT / "rtctl" / "diagnose"
PAGES = (
    "docs/diagnosis.md",
    "docs/diagnosis_details.md",
    "docs/decisions/0017-described-machines-likelihood.md",
    "docs/proof.md",
)


def missing(text: str) -> list[str]:
    """Files and names in a page that are missing in the package."""
    modules: dict[str, list[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        whole = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        modules.setdefault(path.stem, []).append(whole)
    files = re.findall(r"`(\w+)\.py`", text)
    told = re.findall(r"`(\w+)\.(?!py`|json`|yaml`|parquet`)(\w+)`", text)
    names = [(module, name) for module, name in told if module in modules]
    wrong = [f"{file}.py" for file in files if file not in modules]
    there = {module: [importlib.import_module(whole) for whole in modules[module]] for module, _ in names}
    return wrong + [f"{module}.{name}" for module, name in names if not any(hasattr(m, name) for m in there[module])]


@pytest.mark.parametrize("page", PAGES)
def test_names_in_the_pages_exist(page):
    assert missing((ROOT / page).read_text()) == []


def test_missing_name_is_found():
    assert missing("`nowhere.py` `edges.py` `fits.CEILING` `decide.FORM`") == ["nowhere.py", "fits.CEILING"]
