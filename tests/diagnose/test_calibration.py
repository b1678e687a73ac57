"""The numbers of a verdict: all are told in the docs, with the values that the program has."""

import re
from pathlib import Path

from rtctl.diagnose import calibration

ROOT = Path(__file__).parent.parent.parent


def told():
    """Names and values of the rows of the table in docs/diagnosis_details.md."""
    page = (ROOT / "docs" / "diagnosis_details.md").read_text("utf-8")
    table = page.split("## Numbers that the verdict hangs on")[1].split("\n## ")[0]
    rows = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| `")]
    return {tuple(re.findall(r"`(\w+)`", row[0])): tuple(float(v) for v in row[1].split(",")) for row in rows}


def test_the_docs_tell_every_number():
    names = {name for name in vars(calibration) if name.isupper()}
    assert names == {name for row in told() for name in row}
    for row, values in told().items():
        found = [vars(calibration)[name] for name in row]
        flat = [v for one in found for v in (one if isinstance(one, tuple | dict) else (one,))]
        assert tuple(flat) == values
