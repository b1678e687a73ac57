"""The bar: for a terminal alone."""

import pytest
from rich.console import Console

from rtctl.cli.progress import progress


def test_nothing_is_shown_to_a_pipe(capsys):
    with progress("ivu", "failed") as update:
        update(1, 2, 0)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("wrong", [0, 3])
def test_a_terminal_sees_what_is_wrong_beside_the_name(monkeypatch, capsys, wrong):
    monkeypatch.setattr(Console, "is_terminal", True)
    with progress("ivu", "failed") as update:
        update(1, 2, wrong)
    shown = capsys.readouterr().err
    assert "ivu" in shown and ("3 failed" in shown) == bool(wrong)
