"""The tutorials of the machines, played: their commands in order, in one folder, and what the pages say they print.

A section is a test. Each needs those before it, so whichever runs first plays them.
"""

import json
import os
import re
import shlex
import signal
import subprocess
import sys

import pytest
import yaml
from manual_blocks import ROOT, blocks, commands

LIVE = "runs on the wall clock until somebody ends it; tests/cli/test_live.py and tests/scope do that"
NOT_RUN = {"rtctl run ivu --reference steps": LIVE, "rtctl scope ivu --control": LIVE}
ENDPOINT = re.compile(r"tcp://127\.0\.0\.1:\d+")  # replaced by a socket in a temporary folder
HEADING = re.compile(r"^## (\d)\. ", re.M)
DIAGNOSED = 4  # section of the reel unit with fitted figures: compared with a tolerance


def words(text):
    """Words of a text, without column widths, line breaks and salted hashes."""
    return re.sub(r"sha256 \w+(\.\.\.)?", "sha256", " ".join(text.split()))


class Tutorial:
    """A page of the manual, run in `folder`. `said` holds the output of each section."""

    def __init__(self, page, folder, runtime):
        text = (ROOT / "docs" / page).read_text()
        starts = [m.start() for m in HEADING.finditer(text)]
        parts = [text[a:b] for a, b in zip(starts, [*starts[1:], len(text)], strict=True)]
        self.sections = [blocks(ROOT / "docs" / page, part) for part in parts]
        self.folder, self.name = folder, f"tutor{os.getpid()}"
        self.endpoint = f"ipc://{runtime}/{self.name}.bench"
        self.said, self.plant = [], None
        self.environment = {**os.environ, "COLUMNS": "120"}

    def through(self, number):
        """Output of section `number`; earlier sections are run first."""
        while len(self.said) < number:
            self.said.append(self._section(self.sections[len(self.said)]))
        return self.said[number - 1]

    def told(self, number):
        """Output blocks of section `number`."""
        return [block.text for block in self.sections[number - 1] if block.language == "text"]

    def _section(self, section):
        try:
            return "".join(self._run(line) for block in section for _, line in commands(block) if line not in NOT_RUN)
        finally:
            self.close()

    def _run(self, line):
        given = shlex.split(ENDPOINT.sub(self.endpoint, line))[1:]
        if given[0] == "run":  # unique name: a machine with the name of the page may run here
            given += ["--set", f"name={self.name}"]
        command = [sys.executable, "-m", "rtctl.cli.main", *given]
        if "--conceal" in given:
            self._start(command)
            return ""
        done = subprocess.run(command, cwd=self.folder, env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)  # fmt: skip
        assert done.returncode == 0, f"{line}\n{done.stdout}"
        return done.stdout.replace(self.name, given[1])

    def _start(self, command):
        """Start the plant in a separate process; returns when the plant listens."""
        log = self.folder / "plant.log"
        with log.open("w") as file:
            self.plant = subprocess.Popen(command, cwd=self.folder, env=self.environment, stdout=subprocess.PIPE,
                                          stderr=file, text=True)  # fmt: skip
        said = ""
        while "plant listens at" not in said:
            said = self.plant.stdout.readline()
            assert said, log.read_text()

    def close(self):
        """Stop the plant with Ctrl-C, as at the end of the section."""
        if self.plant is not None:
            self.plant.send_signal(signal.SIGINT)
            self.plant.communicate(timeout=60)
            self.plant = None


@pytest.fixture(scope="module")
def reel_unit(runtime, tmp_path_factory):
    return Tutorial("tutorial_ivu.md", tmp_path_factory.mktemp("ivu"), runtime)


@pytest.fixture(scope="module")
def linear_drive(runtime, tmp_path_factory):
    return Tutorial("tutorial_ldu.md", tmp_path_factory.mktemp("ldu"), runtime)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_reel_unit_tutorial_prints_the_documented_output(reel_unit, number):
    said = words(reel_unit.through(number))
    for text in reel_unit.told(number):
        assert words(text) in said
    made = {1: "runs/first/run.png", 2: "runs/soft/run.png", 3: "hidden.json"}[number]
    assert (reel_unit.folder / made).exists()


def test_recording_does_not_contain_the_hidden_effect(reel_unit):
    reel_unit.through(3)
    case = json.loads((reel_unit.folder / "runs/monday/case.json").read_text())
    assert "asymmetry" not in json.dumps(case["config"]["plant"])
    page = (ROOT / "docs" / "tutorial_ivu.md").read_text()
    half, full = (float(x) for x in re.search(r"final error, ([\d.]+) mm instead of ([\d.]+)", page).groups())
    steps = [re.findall(r"^ *1\.40 .*$", reel_unit.through(n), re.M)[0].split() for n in (1, 2)]
    assert [abs(float(step[3])) for step in steps] == pytest.approx([full, half], abs=6e-4)


@pytest.mark.long
def test_reel_unit_tutorial_diagnoses_the_hidden_effect(reel_unit):
    said = words(reel_unit.through(DIAGNOSED))
    answer, seal = (words(text) for text in reel_unit.told(DIAGNOSED))
    assert seal in said
    assert all("named Drive 1 is stronger one way: 18 %" in text for text in (said, answer))
    assert "unequal gain (drive.gain_asymmetry) drive 1" in said
    found = [float(re.search(r"a = ([\d.]+)", text)[1]) for text in (said, answer)]
    assert found[0] == pytest.approx(found[1], rel=0.1)
    folder = reel_unit.folder / "runs/monday/diagnosis"
    assert {"report.html", "model.yaml"} <= {path.name for path in folder.iterdir()}


@pytest.mark.long
def test_diagnosed_model_improves_as_documented(reel_unit):
    said = reel_unit.through(5)
    page = (ROOT / "docs" / "tutorial_ivu.md").read_text()
    table = re.findall(r"^\| `(?:ivu|model\.yaml)`.*\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", page, re.M)
    told = [float(value) for row in table for value in row]
    found = [float(value) for value in re.findall(r"^\w+_counts +([\d.]+) counts", said, re.M)]
    assert len(told) == 6
    assert found == pytest.approx(told, rel=0.2, abs=0.1)
    assert all((reel_unit.folder / name).stat().st_size > 10_000 for name in ("before.png", "after.png"))
    model = yaml.safe_load((reel_unit.folder / "runs/monday/diagnosis/model.yaml").read_text())
    assert "drive.gain_asymmetry" in json.dumps(model["plant"]["physics"])
    assert (reel_unit.folder / "runs/twin/case.json").exists()


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_linear_drive_tutorial_prints_the_documented_output(linear_drive, number):
    said = words(linear_drive.through(number))
    for text in linear_drive.told(number):
        assert words(text) in said
    made = {1: "runs/before/run.png", 2: "tuned.png", 3: "runs/after/run.png", 4: "scale.png"}[number]
    assert (linear_drive.folder / made).stat().st_size > 10_000


@pytest.mark.parametrize("page", ["tutorial_ivu.md", "tutorial_ldu.md"])
def test_every_tutorial_command_is_in_a_section(page):
    text = (ROOT / "docs" / page).read_text()
    before = text[: HEADING.search(text).start()]
    after = text[list(HEADING.finditer(text))[-1].start() :].partition("\n## ")[2]
    assert not [line for part in (before, after) for b in blocks(ROOT / "docs" / page, part) for line in commands(b)]


def test_skipped_commands_exist_in_a_page():
    pages = [ROOT / "docs" / page for page in ("tutorial_ivu.md", "tutorial_ldu.md")]
    lines = {line for page in pages for block in blocks(page) for _, line in commands(block)}
    assert NOT_RUN.keys() <= lines
