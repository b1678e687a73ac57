"""Diagnosis of a folder of bundles by several processes.

A bundle whose diagnosis is newer than its recording is not diagnosed again: interrupted work resumes where it stopped.
Each of several processes simulates with one thread: one process for each core uses all cores.
"""

import json
import os
import signal
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.failures import told
from rtctl.diagnose.answer.results import FOLDER, RESULT
from rtctl.trace.bundle import ARROWS, CASE, PARQUET

SECOND = "-heldout"  # suffix of a bundle that is a second recording of the same machine
ALONE = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
LIMIT = 600.0  # s, for one diagnosis
OURS, BAD, NO_VERDICT = 1, UserError.exit_code, NoAnswer.exit_code


class Task(NamedTuple):
    """Bundle, folder of its diagnosis, and a second recording of the same machine or None."""

    name: str
    bundle: Path
    out: Path
    other: Path | None = None


class Outcome(NamedTuple):
    """Outcome of one bundle. `code` is the exit code of a diagnosis of this bundle alone."""

    name: str
    code: int  # 0 a verdict, 1 our fault, 2 a bad bundle, 3 no verdict possible
    seconds: float
    diagnosis: dict[str, Any] | None = None  # as in diagnosis.json
    message: str = ""
    skipped: bool = False  # the diagnosis existed already

    def as_json(self) -> dict[str, Any]:
        """Diagnosis, or the error of the bundle."""
        if self.diagnosis is not None:
            return {**self.diagnosis, "skipped": self.skipped}
        return {"error": self.message, "exit_code": self.code, "seconds": round(self.seconds, 2)}


Work = Callable[[Task, bool], Outcome]


def is_bundle(folder: Path) -> bool:
    """Whether the folder is a bundle, or a part of a bundle."""
    return any((folder / name).is_file() for name in (CASE, PARQUET, ARROWS))


def tasks(folder: Path, out: Path | None = None, other: Path | None = None) -> list[Task]:
    """Tasks, one for each bundle in `folder`, by name; none where `folder` is no folder of bundles.

    Results go to `out`/NAME, or into each bundle. A second recording is `other`/NAME, or NAME-heldout beside NAME.
    """
    if not folder.is_dir() or is_bundle(folder):
        return []
    found = {p.name: p for p in sorted(folder.iterdir()) if p.is_dir() and is_bundle(p)}
    made = []
    for name, bundle in found.items():
        if name.endswith(SECOND) and name.removesuffix(SECOND) in found:
            continue
        second = other / name if other is not None else found.get(name + SECOND)
        made.append(Task(name, bundle, out / name if out is not None else bundle / FOLDER, second))
    return made


def done(task: Task) -> Outcome | None:
    """Outcome of an earlier diagnosis that is newer than its sources; None where there is none."""
    path = task.out / RESULT
    try:
        made = path.stat().st_mtime_ns
        sources = [folder / name for folder in (task.bundle, task.other) if folder for name in (PARQUET, CASE)]
        sources = [source for source in sources if source.exists()]  # a long recording has its case on top
        if any(source.stat().st_mtime_ns > made for source in sources):
            return None
        diagnosis = json.loads(path.read_text("utf-8"))
        return Outcome(task.name, 0, float(diagnosis["seconds"]), diagnosis, skipped=True)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def one(task: Task, report: bool) -> Outcome:
    """Outcome of one bundle, diagnosed into its folder. Raises nothing: the outcome reports errors."""
    from rtctl.diagnose.bundles import diagnose_into

    began = time.monotonic()
    try:
        made = diagnose_into(task.bundle, task.other, task.out, report, task.out.parent)
        return Outcome(task.name, 0, time.monotonic() - began, made.data, "; ".join(made.faults))
    except (UserError, NoAnswer) as error:
        return Outcome(task.name, error.exit_code, time.monotonic() - began, message=_line(error))
    except Exception as error:
        code, message = told(error)
        return Outcome(task.name, code, time.monotonic() - began, message=message)


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def diagnose_all(
    waiting: list[Task], jobs: int = 1, limit: float = LIMIT, report: bool = True, work: Work = one
) -> Iterator[Outcome]:
    """Outcomes of up to `jobs` processes in the order of completion; a process is ended after `limit` s."""
    left = deque(waiting)
    crew: list[_Worker] = []
    try:
        while left or any(worker.task for worker in crew):
            while left and len(crew) < min(jobs, len(waiting)):
                crew.append(_Worker(jobs, report, work))
            for worker in crew:
                if left and worker.task is None:
                    worker.give(left.popleft())
            first = min(worker.began for worker in crew if worker.task) + limit
            wait([worker.pipe for worker in crew if worker.task], max(first - time.monotonic(), 0.0))
            for worker in [w for w in crew if w.task]:
                outcome = worker.outcome(limit)
                if outcome is not None:
                    if not worker.alive:
                        crew.remove(worker)
                    yield outcome
    finally:
        for worker in crew:
            worker.end()


class _Worker:
    """Process that diagnoses one task at a time."""

    def __init__(self, jobs: int, report: bool, work: Work):
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, jobs, report, work), daemon=True)
        with _alone():
            self.process.start()
        theirs.close()
        self.task: Task | None = None
        self.began = 0.0
        self.alive = True

    def give(self, task: Task) -> None:
        """Start a task."""
        self.task, self.began = task, time.monotonic()
        self.pipe.send(task)

    def outcome(self, limit: float) -> Outcome | None:
        """Outcome of the task; None while the task runs."""
        assert self.task is not None
        name, seconds = self.task.name, time.monotonic() - self.began
        found: Outcome | None = None
        if self.pipe.poll():
            try:
                found = self.pipe.recv()
            except (EOFError, OSError):
                self.end()
                code = self.process.exitcode
                found = Outcome(name, OURS, seconds, message=f"its process died (exit code {code})")
        elif seconds >= limit:
            self.end()
            found = Outcome(name, OURS, seconds, message=f"not done within --limit {limit:g} s")
        if found is not None:
            self.task = None
        return found

    def end(self) -> None:
        """Kill the process."""
        self.alive = False
        self.process.kill()
        self.process.join()
        self.pipe.close()


def _serve(pipe: Connection, jobs: int, report: bool, work: Work) -> None:
    """Run the tasks from the pipe until the parent closes the pipe. The parent handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    warnings.simplefilter("ignore", RuntimeWarning)  # an unstable model overflows; the outcome reports it
    if jobs > 1:
        from rtctl.diagnose.likelihood.solver import THREADS

        THREADS.set(1)
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        pipe.send(work(task, report))


def _end_with_parent() -> None:
    """End this process when its parent is killed: nobody would read the diagnosis."""
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(OURS)


@contextmanager
def _alone() -> Iterator[None]:
    """Context in which started processes use one thread for linear algebra."""
    before = {name: os.environ.get(name) for name in ALONE}
    os.environ.update(dict.fromkeys(ALONE, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
