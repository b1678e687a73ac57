"""`rtctl fault`: the catalogue, faults of a running machine, and error messages."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from rtctl.tick.faults import KINDS


def test_fault_catalogue_lists_every_fault_with_its_unit(rtctl: Callable[..., Any]) -> None:
    said = rtctl("fault", "list", "--catalogue")
    assert said.code == 0
    assert [line.split()[0] for line in said.out.splitlines()] == list(KINDS)
    found = json.loads(rtctl("fault", "list", "--catalogue", "--json").out)["faults"]
    assert {f["fault"]: f["unit"] for f in found} == {name: kind.unit for name, kind in KINDS.items()}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("add", "encoder.feeze"), "did you mean 'encoder.freeze'?"),
        (("add", "link.delay", "--size", "3mm"), "--size 3mm: this size is in s"),
        (("add", "link.loss", "--size", "3s"), "a number without a unit"),
        (("add", "link.loss", "--for", "soon"), "--for soon: not a duration"),
        (("table", "--machine", "lda"), "ivu, ldu or all"),
        (("table", "--markdown", "/nowhere/faults.md"), "there is no folder /nowhere"),
    ],
)
def test_invalid_fault_is_an_error(rtctl: Callable[..., Any], words: tuple[str, ...], message: str) -> None:
    said = rtctl("fault", *words)
    assert said.code == 2 and message in said.err


@pytest.mark.realtime
def test_faults_of_a_running_machine_are_added_listed_and_cleared(rtctl: Callable[..., Any], machine: str) -> None:
    added = rtctl("fault", "add", "link.delay", "--at", "100s", "--for", "2s", "--size", "20ms", "--name", machine)
    assert added.code == 0 and added.out.startswith("link.delay, size 10: tick ")
    found = json.loads(rtctl("fault", "list", "--name", machine, "--json").out)["faults"]
    assert [(f["fault"], f["end"] - f["begin"], f["active"]) for f in found] == [("link.delay", 1000, False)]
    assert "no channel 5" in rtctl("fault", "add", "dac.stuck", "--channel", "5", "--name", machine).err
    assert rtctl("fault", "clear", "--name", machine).code == 0
    assert rtctl("fault", "list", "--name", machine).out.startswith("no faults")
