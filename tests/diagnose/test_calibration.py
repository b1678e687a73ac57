"""Calibration constants of a verdict: the docs list all of them with the values of the program."""

import re
from pathlib import Path

from rtctl.diagnose import calibration

ROOT = Path(__file__).parent.parent.parent


def documented_constants():
    """Names and values of the table in docs/diagnosis_details.md."""
    page = (ROOT / "docs" / "diagnosis_details.md").read_text("utf-8")
    table = page.split("## Numbers that the verdict hangs on")[1].split("\n## ")[0]
    rows = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| `")]
    return {tuple(re.findall(r"`(\w+)`", row[0])): tuple(float(v) for v in row[1].split(",")) for row in rows}


def test_docs_list_every_calibration_constant():
    names = {name for name in vars(calibration) if name.isupper()}
    assert names == {name for row in documented_constants() for name in row}
    for row, values in documented_constants().items():
        found = [vars(calibration)[name] for name in row]
        flat = [v for one in found for v in (one if isinstance(one, tuple | dict) else (one,))]
        assert tuple(flat) == values
