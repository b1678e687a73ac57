"""`rtctl reproduce`: exit codes, JSON, progress on stderr, and the page on request."""

import json

import pytest
from typer.testing import CliRunner

from rtctl.cli import reproduce as cli
from rtctl.config.errors import UserError
from rtctl.reproduce import chapter07, run


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def asked(*arguments: str):
    return CliRunner().invoke(cli.app, [*arguments, "--jobs", "1"])


def test_json_contains_the_rows():
    done = asked("--only", "7", "--short", "--json")
    assert done.exit_code == 0
    rows = json.loads(done.stdout)["rows"]
    assert len(rows) == len(chapter07.DRIVER) + len(chapter07.MOTOR)
    for row in rows:
        assert {"name", "source", "thesis", "measured", "tolerance", "pass", "erratum"} <= set(row)
        assert {"law", "set", "filter", "quote", "verdict"} <= set(row)
        assert row["pass"] is True
    assert sum(row["erratum"] is not None for row in rows) == 4
    assert sum(row["verdict"] == "chosen" for row in rows) == 4
    assert "[2/2] chapter 7" in done.stderr


def test_failing_row_is_exit_code_1(monkeypatch):
    row = chapter07.DRIVER[0]._replace(thesis=0.5)
    part = chapter07.PARTS[0]._replace(rows=(row,))
    monkeypatch.setattr(run, "parts", lambda only: [part])
    done = asked("--only", "7.sensing_resistor")
    assert done.exit_code == 1
    assert "FAIL    7.sensing_resistor" in done.stdout and "Failing: 7.sensing_resistor" in done.stdout


def test_row_with_a_declared_difference_is_no_failure(monkeypatch):
    row = chapter07.DRIVER[0]._replace(thesis=0.5, chosen="", differs="another resistor")
    monkeypatch.setattr(run, "parts", lambda only: [chapter07.PARTS[0]._replace(rows=(row,))])
    done = asked("--only", "7.sensing_resistor")
    assert done.exit_code == 0 and "differs 7.sensing_resistor" in done.stdout
    monkeypatch.setattr(run, "parts", lambda only: [chapter07.PARTS[0]._replace(rows=(row._replace(thesis=0.24),))])
    assert asked("--only", "7.sensing_resistor").exit_code == 1


def test_page_and_figures_are_written_on_request(tmp_path):
    done = asked("--only", "7.4", "--out", "here")
    assert done.exit_code == 0
    assert "## Chapter 7" in (tmp_path / "here" / "reproduction.md").read_text()
    assert (tmp_path / "here" / run.FOLDER / "figure_7_4.png").is_file()


def test_partial_reproduction_writes_no_page(tmp_path):
    (tmp_path / "docs").mkdir()
    assert asked("--only", "7.oscillator").exit_code == 0
    assert not list((tmp_path / "docs").iterdir())


def test_invalid_arguments_are_refused(tmp_path):
    done = asked("--only", "99")
    assert isinstance(done.exception, UserError) and "no such chapter" in str(done.exception)
    done = asked()
    assert isinstance(done.exception, UserError) and "--out DIR" in str(done.exception)
    (tmp_path / "file").write_text("")
    done = asked("--out", "file", "--only", "7.oscillator")
    assert isinstance(done.exception, UserError) and "cannot be made" in str(done.exception)
