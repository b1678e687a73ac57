"""Capture from before the alarm, diagnosis in another process, and messages of failures."""

import json
import os
import subprocess
import sys

import pytest

from rtctl.config.errors import UserError
from rtctl.watch import background
from rtctl.watch.background import ALL, BEFORE, Background, lowest


class Fake:
    """A daemon whose captures finish immediately."""

    def __init__(self, done=True, **beside):
        self.done, self.beside, self.asked = done, beside, []

    def call(self, op, **args):
        self.asked.append((op, args))
        if op == "capture":
            self.out = args["out"]
            return {"id": "1", "bundle": self.out}
        return {"id": "1", "done": self.done, "bundle": self.out, **self.beside}


def diagnoses(tmp_path, monkeypatch, program):
    monkeypatch.setattr(background, "python", lambda *words: [sys.executable, "-c", program, words[3]])


def finish(made):
    made.look()
    made._process.wait()
    return made.look()


def test_capture_starts_before_the_alarm_and_is_diagnosed_at_low_priority(tmp_path, monkeypatch):
    found = {"headline": "Motor 2 sticks.", "effects": [{"check": "Look at its bearing."}]}
    program = (
        "import sys, pathlib, os; d = pathlib.Path(sys.argv[1]) / 'diagnosis'; d.mkdir(parents=True)\n"
        f"(d / 'diagnosis.json').write_text({json.dumps(found)!r}); (d / 'report.html').write_text('')\n"
        "(d / 'nice').write_text(str(os.nice(0)))"
    )
    diagnoses(tmp_path, monkeypatch, program)
    fake = Fake()
    made = Background(fake, tmp_path / "alarm")
    assert made.begin() is None
    assert fake.asked[0] == ("capture", {"seconds": ALL, "pre": BEFORE, "out": str(tmp_path / "alarm")})
    assert finish(made) is None
    assert made.done
    assert made.diagnosis == "Motor 2 sticks. Look at its bearing."
    assert made.page == tmp_path / "alarm" / "diagnosis" / "report.html"
    assert (tmp_path / "alarm" / "diagnosis" / "nice").read_text() == "19"


def test_failed_diagnosis_is_reported(tmp_path, monkeypatch):
    diagnoses(tmp_path, monkeypatch, "import sys; sys.exit('rtctl: nothing moved')")
    made = Background(Fake(), tmp_path / "alarm")
    made.begin()
    assert "nothing moved" in finish(made)
    assert made.done


def test_refused_or_failed_capture_is_reported(tmp_path):
    class Refuses:
        def call(self, op, **_):
            raise UserError("8 captures are running")

    assert Background(Refuses(), tmp_path).begin() == "nothing was captured: 8 captures are running"
    made = Background(Fake(error="disk full"), tmp_path / "a")
    made.begin()
    assert made.look() == "disk full"
    assert made.done
    waits = Background(Fake(done=False), tmp_path / "b")
    waits.begin()
    assert waits.look() is None
    assert not waits.done


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one processor")
def test_background_process_avoids_the_processor_of_the_control_loop():
    cpu = max(os.sched_getaffinity(0))
    said = subprocess.run(
        [sys.executable, "-c", "import os; print(os.nice(0), sorted(os.sched_getaffinity(0)))"],
        preexec_fn=lambda: lowest(cpu), capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert said.startswith("19 ")
    assert str(cpu) not in said.split(" ", 1)[1]
