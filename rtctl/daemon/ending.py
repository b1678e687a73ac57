"""Failures that end a run: the loop's process was killed or crashed, or a child reported an error.

The recording is finished first, so the failure is kept and raised at the end of the run.
"""

import contextlib
import subprocess
from collections.abc import Callable
from typing import Any

from rtctl.config.errors import RunFailed, UserError
from rtctl.daemon.starting import ended

LAST_WORDS = 5.0  # s to wait for the report of a loop after its last tick


def reported(hear: Callable[[], None]) -> Exception | None:
    """Error that a child has reported since the last call, else None; `hear` reads the reports."""
    try:
        hear()
    except UserError as error:
        return error
    return None


def failure(loop: Any, status: Any, hear: Callable[[], None]) -> Exception | None:
    """Failure of a loop (ChildProcess) that has ended; `status` is its record. None where the end was ordered."""
    if status["failed"] or not status["ended"]:
        with contextlib.suppress(subprocess.TimeoutExpired):
            loop.process.wait(LAST_WORDS)
    told = reported(hear)
    if told is None and not status["ended"] and loop.process.poll() not in (None, 0):
        return RunFailed(f"the loop's process died after tick {int(status['tick'])}: {ended(loop)}")
    return told
