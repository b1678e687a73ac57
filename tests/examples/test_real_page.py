"""The pages of proofs and of real machines tell what was found, and show it."""

import json
import re

from real_cases import ROOT, cases
from run import FOUND, PAGE, page

MISSING = {"hydraulic_load", "ess_x"}  # no answer in half an hour


def test_the_table_is_that_of_what_was_found():
    text = PAGE.read_text()
    assert page(text) == text


def test_every_case_was_run():
    found = {file.stem: json.loads(file.read_text()) for file in FOUND.glob("*.json")}
    assert set(found) | MISSING == set(cases())
    assert all(f["verdict"] in ("named", "ambiguous", "unnamed", "nothing") for f in found.values())


def test_no_answer_names_what_would_be_wrong_and_says_nothing_of_it():
    wrong = {
        name for name, case in cases().items()
        if (file := FOUND / f"{name}.json").exists()
        and {e["name"] for e in json.loads(file.read_text())["effects"]} & set(case.get("wrong", []))
    }  # fmt: skip
    assert len(re.findall(r": wrong\*\*", PAGE.read_text())) >= len(wrong)


def test_every_figure_is_there():
    shown = re.findall(r"\(images/(real/[^)]+)\)", (ROOT / "docs" / "real_machines.md").read_text())
    assert len(shown) > 5
    for name in shown:
        assert (ROOT / "docs" / "images" / name).is_file(), name
