"""`rtctl new`, and the tutorial that starts from its files."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rtctl.cli.common import load_config

DOC = Path(__file__).parents[2] / "docs" / "tutorial_own_law.md"
BLOCK = re.compile(r"(?P<before>[^\n]*(?:\n[^\n]+)*)\n\n```(?P<kind>\w+)\n(?P<text>.*?)^```", re.MULTILINE | re.DOTALL)
pytestmark = pytest.mark.usefixtures("library")


def pytest_in(folder, *files):
    """Run `pytest` in a folder."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *files]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=280, check=False)


def test_new_files_pass_their_tests_and_the_checks(rtctl, tmp_path):
    for kind, name, machine in (("law", "Cascade", "axis"), ("plant", "slide", "axis"), ("term", "air_drag", "ivu")):
        code, out, err = rtctl("new", kind, name, "--for", machine, "--into", tmp_path / "new")
        assert (code, err) == (0, "")
        assert out.splitlines()[-1].startswith("next: pytest ")
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == sorted(
        f"{head}{stem}.{end}"
        for stem in ("cascade", "slide", "air_drag")
        for head, end in (("", "py"), ("test_", "py"), ("", "yaml"))
    )
    run = pytest_in(tmp_path / "new")
    assert run.returncode == 0, run.stdout
    for stem in ("cascade", "slide", "air_drag"):
        code, out, err = rtctl("check", tmp_path / "new" / f"{stem}.yaml")
        assert (code, err) == (0, ""), err
    assert "V/m" in (tmp_path / "new" / "cascade.py").read_text()
    assert not any("my_" in p.read_text().lower() for p in (tmp_path / "new").glob("*.py"))


@pytest.mark.parametrize("name", ["l_ivu", "a_b_c", "v2_law", "PIController", "my__law", "pd2x", "X", "law_2"])
def test_every_accepted_name_gives_a_config_that_loads(rtctl, tmp_path, name):
    for kind, machine in (("law", "ivu"), ("plant", "axis"), ("term", "ldu")):
        folder = tmp_path / kind
        assert rtctl("new", kind, name, "--for", machine, "--into", folder).code == 0
        (config,) = folder.glob("*.yaml")
        load_config(str(config), [])


def test_new_never_overwrites(rtctl, tmp_path):
    (tmp_path / "slide.yaml").write_text("mine\n")
    code, _, err = rtctl("new", "law", "slide", "--into", tmp_path)
    assert code == 2
    assert "slide.yaml: there already, and nothing is overwritten" in err
    assert [p.name for p in tmp_path.iterdir()] == ["slide.yaml"]
    assert (tmp_path / "slide.yaml").read_text() == "mine\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["low", "x"], "kind 'low': it is law, plant, term, machine, config; did you mean 'law'?"),
        (["law", "x", "--for", "lud"], "machine 'lud': it is ivu, ldu, axis; did you mean 'ldu'?"),
        (["law", "3x"], "'3x' is no name for a Python file"),
        (["law", "../x"], "'../x' is no name for a Python file"),
        (["law", "numpy"], "'numpy' is the name of something in Python already"),
        (["law", "while"], "'while' is the name of something in Python already"),
    ],
)
def test_invalid_name_is_refused(rtctl, tmp_path, words, message):
    code, _, err = rtctl("new", *words, "--into", tmp_path / "none")
    assert code == 2 and message in err
    assert not (tmp_path / "none").exists()


@pytest.mark.long
def test_tutorial_commands_run(rtctl, tmp_path, monkeypatch):
    """Runs the commands of the tutorial in order, in a new folder. Console blocks need real time and are skipped."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    said = {}
    for block in BLOCK.finditer(DOC.read_text()):
        if block["kind"] in ("python", "yaml"):
            (tmp_path / re.findall(r"`(\w+\.\w+)`", block["before"])[-1]).write_text(block["text"])
            continue
        for line in block["text"].splitlines() if block["kind"] == "sh" else []:
            program, *words = shlex.split(line)
            if program == "pytest":
                run = pytest_in(tmp_path, *words)
                assert run.returncode == 0, run.stdout
            else:
                assert program == "rtctl"
                said[line] = rtctl(*words)
                assert said[line].code == 0, f"{line}\n{said[line].err}"
    checked = [s.out for line, s in said.items() if " check " in line]
    assert all("allocates nothing" in out for out in checked)
    assert (tmp_path / "own_law.png").stat().st_size > 10_000
    assert (tmp_path / "ff" / "own" / "feedforward.py").read_text() == (tmp_path / "feedforward.py").read_text()
    assert "identical to the bit" in said["rtctl replay ff"].out
    largest = [_largest(tmp_path / run) for run in ("pd", "ff")]
    told = re.search(r"falls from (\d+) um to (\d+) um", DOC.read_text())
    assert told and [round(1e6 * v) for v in largest] == [int(told[1]), int(told[2])]


def _largest(bundle):
    """Largest position error of a run, m."""
    from rtctl.trace.bundle import load_bundle

    columns = load_bundle(bundle).columns
    return abs(columns["position_error"][columns["state"] == 2]).max()


def test_mistakes_shown_in_the_tutorial_give_the_printed_errors(rtctl, tmp_path):
    rtctl("new", "law", "try_law", "--for", "ldu", "--into", tmp_path)
    file = tmp_path / "try_law.py"
    text = file.read_text()
    file.write_text(text.replace("p.gain * (e", "p.gian * (e"))
    code, out, err = rtctl("check", tmp_path / "try_law.yaml")
    assert (code, out) == (2, "")
    assert re.fullmatch(
        r"rtctl: \./try_law\.py:\d+: p\.gian: TryLawParams has no 'gian'; did you mean p\.gain\?\n", err
    )
    file.unlink()
    code, _, err = rtctl("run", tmp_path / "try_law.yaml", "--mode", "fused", "--for", "1s")
    assert code == 2 and "law.position.kind: ./try_law.py: no such file" in err
