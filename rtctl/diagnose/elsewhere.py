"""Diagnosis of a folder of bundles by the workers of a Dask scheduler.

Each worker starts the command that diagnoses one bundle: a diagnosis that takes too long can be ended, and no diagnosis
leaves state in the worker. The paths of bundles and results are valid on every worker.
"""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial

from rtctl import workers
from rtctl.config.errors import UserError
from rtctl.diagnose.folder import OURS, Outcome, Task


def diagnose_elsewhere(waiting: list[Task], scheduler: str, limit: float, report: bool) -> Iterator[Outcome]:
    """Outcomes in the order of completion; a diagnosis that takes longer than `limit` s is ended.

    Raises UserError where the scheduler does not exist or its workers do not see the bundles, PoolError where a worker
    dies.
    """
    found = workers.dask(partial(_one, limit=limit, report=report), [_absolute(task) for task in waiting], scheduler)
    return (outcome for _, outcome in found)


def _absolute(task: Task) -> Task:
    other = None if task.other is None else task.other.resolve()
    return task._replace(bundle=task.bundle.resolve(), out=task.out.resolve(), other=other)


def _one(task: Task, limit: float, report: bool) -> Outcome:
    """Outcome of one bundle, diagnosed in a process of its own on a worker."""
    if not task.bundle.is_dir():
        raise UserError(
            f"a worker of the scheduler does not see {task.bundle}; recordings lie where it finds them by the same "
            "path, as on a shared disk"
        )
    command = [sys.executable, "-m", "rtctl", "diagnose", str(task.bundle), "--out", str(task.out), "--json"]
    command += [] if task.other is None else ["--heldout", str(task.other)]
    command += [] if report else ["--no-report"]
    began = time.monotonic()
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return Outcome(task.name, OURS, time.monotonic() - began, message=f"not done within --limit {limit:g} s")
    seconds = time.monotonic() - began
    said = " ".join(ran.stderr.split()).removeprefix("rtctl: ")
    if ran.returncode:
        return Outcome(task.name, ran.returncode, seconds, message=said or f"exit code {ran.returncode}")
    return Outcome(task.name, 0, seconds, json.loads(ran.stdout), said)
