"""Capture of an alarm and its diagnosis in a process of the lowest priority, off the processor of the loop."""

import contextlib
import json
import os
import subprocess
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.isolated import python
from rtctl.daemon.client import Client
from rtctl.diagnose.answer.results import FOLDER, REPORT, RESULT

BEFORE, ALL = 10.0, 25.0  # s of a capture before the alarm, and in all
NICE = 19
ALONE = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def lowest(cpu: int | None = None) -> None:
    """Give this process the lowest priority, and every processor but `cpu`, that of the loop. A setting that the system
    refuses stays unchanged."""
    with contextlib.suppress(OSError):
        os.nice(NICE - os.nice(0))
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    aside(cpu)


def aside(cpu: int | None) -> None:
    """Keep this process off a processor, as far as there are others."""
    with contextlib.suppress(OSError, AttributeError):
        others = os.sched_getaffinity(0) - {cpu}
        if cpu is not None and others:
            os.sched_setaffinity(0, others)


class Background:
    """A capture that begins BEFORE seconds ahead of an alarm, then its diagnosis. `look` polls both and never waits."""

    def __init__(self, client: Client, out: Path, cpu: int | None = None, diagnose: bool = True):
        self._client, self._out, self._cpu, self._diagnose = client, out, cpu, diagnose
        self._capture: str | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self.bundle: Path | None = None
        self.diagnosis: str | None = None  # a sentence, once the diagnosis has ended
        self.page: Path | None = None

    def begin(self) -> str | None:
        """Start the capture; a sentence with the reason where it does not start."""
        try:
            started = self._client.call("capture", seconds=ALL, pre=BEFORE, out=str(self._out.absolute()))
        except UserError as error:
            return f"nothing was captured: {error}"
        self._capture, self.bundle = started["id"], Path(started["bundle"])
        return None

    @property
    def done(self) -> bool:
        """Whether neither capture nor diagnosis is running."""
        return self._capture is None and self._process is None

    def look(self) -> str | None:
        """Poll capture and diagnosis; a sentence where one failed."""
        if self._capture is not None:
            return self._look_at_capture(self._capture)
        if self._process is not None and self._process.poll() is not None:
            return self._read(self._process)
        return None

    def close(self) -> None:
        """End the diagnosis, if one runs."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            self._process.wait()
        self._process = None

    def _look_at_capture(self, identity: str) -> str | None:
        try:
            state = self._client.call("capture_status", id=identity)
        except UserError as error:
            self._capture = None
            return f"the capture ended with the machine: {error}"
        if not state["done"]:
            return None
        self._capture = None
        self.bundle = Path(state["bundle"])
        if state.get("error"):
            return str(state["error"])
        if self._diagnose:
            cpu = self._cpu
            self._process = subprocess.Popen(
                python("-m", "rtctl", "diagnose", str(self.bundle), "--out", str(self.bundle / FOLDER)),
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                env={**os.environ, **dict.fromkeys(ALONE, "1")}, preexec_fn=lambda: lowest(cpu),
            )  # fmt: skip
        return None

    def _read(self, process: "subprocess.Popen[bytes]") -> str | None:
        self._process = None
        assert process.stderr is not None and self.bundle is not None
        said = process.stderr.read().decode(errors="replace").strip().splitlines()
        path = self.bundle / FOLDER / RESULT
        try:
            found: dict[str, Any] = json.loads(path.read_text("utf-8"))
        except (OSError, ValueError):
            return f"no diagnosis of {self.bundle} (exit code {process.returncode}): {said[-1] if said else 'no words'}"
        self.diagnosis = told(found)
        page = path.parent / REPORT
        self.page = page if page.exists() else None
        return None


def told(diagnosis: dict[str, Any]) -> str:
    """Sentence on the result of a diagnosis and its first check."""
    checks = [effect["check"] for effect in diagnosis["effects"] if effect.get("check")]
    return " ".join([str(diagnosis["headline"]), *checks[:1]])
