"""Progress bar: on a terminal only."""

import pytest
from rich.console import Console

from rtctl.cli.progress import progress


def test_no_progress_bar_on_a_pipe(capsys):
    with progress("ivu", "failed") as update:
        update(1, 2, 0)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("wrong", [0, 3])
def test_progress_bar_shows_the_number_of_failures(monkeypatch, capsys, wrong):
    monkeypatch.setattr(Console, "is_terminal", True)
    with progress("ivu", "failed") as update:
        update(1, 2, wrong)
    shown = capsys.readouterr().err
    assert "ivu" in shown and ("3 failed" in shown) == bool(wrong)
