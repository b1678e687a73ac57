"""A folder of bundles, diagnosed by several processes.

A bundle whose diagnosis is there and newer than its recording is not diagnosed again, so that work that was broken off
goes on where it stopped. Of several processes each simulates with one thread, so that as many as there are cores use
them all.
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

SECOND = "-heldout"  # a bundle of this name beside another is a second recording of the same machine
ALONE = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
LIMIT = 600.0  # s
OURS, BAD, NO_VERDICT = 1, UserError.exit_code, NoAnswer.exit_code


class Task(NamedTuple):
    """A bundle, where its diagnosis goes, and a second recording of the same machine or None."""

    name: str
    bundle: Path
    out: Path
    other: Path | None = None


class Outcome(NamedTuple):
    """What came of one bundle. `code` is the exit code that it would have had by itself."""

    name: str
    code: int  # 0 a verdict, 1 our fault, 2 a bad bundle, 3 no verdict possible
    seconds: float
    diagnosis: dict[str, Any] | None = None  # as in diagnosis.json
    message: str = ""
    skipped: bool = False  # it was there already

    def as_json(self) -> dict[str, Any]:
        """The diagnosis, or what is wrong with the bundle."""
        if self.diagnosis is not None:
            return {**self.diagnosis, "skipped": self.skipped}
        return {"error": self.message, "exit_code": self.code, "seconds": round(self.seconds, 2)}


Work = Callable[[Task, bool], Outcome]


def is_bundle(folder: Path) -> bool:
    """Whether the folder is a bundle, or what is left of one."""
    return any((folder / name).is_file() for name in (CASE, PARQUET, ARROWS))


def tasks(folder: Path, out: Path | None = None, other: Path | None = None) -> list[Task]:
    """A task for each bundle in `folder`, by name; none where it is no folder of bundles.

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
    """The diagnosis of an earlier time, where it is newer than all that it was made from."""
    path = task.out / RESULT
    try:
        made = path.stat().st_mtime_ns
        sources = [folder / name for folder in (task.bundle, task.other) if folder for name in (PARQUET, CASE)]
        sources = [source for source in sources if source.exists()]  # of a long recording the case on top
        if any(source.stat().st_mtime_ns > made for source in sources):
            return None
        diagnosis = json.loads(path.read_text("utf-8"))
        return Outcome(task.name, 0, float(diagnosis["seconds"]), diagnosis, skipped=True)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def one(task: Task, report: bool) -> Outcome:
    """Diagnose one bundle into its folder. Nothing is raised: what went wrong is told in the outcome."""
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
    """Outcomes as they come, of up to `jobs` processes; one that takes longer than `limit` s is ended."""
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
    """One process that diagnoses what it is given."""

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
        """Begin with a bundle."""
        self.task, self.began = task, time.monotonic()
        self.pipe.send(task)

    def outcome(self, limit: float) -> Outcome | None:
        """What came of the task; None while it runs."""
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
        """End the process, whatever it does."""
        self.alive = False
        self.process.kill()
        self.process.join()
        self.pipe.close()


def _serve(pipe: Connection, jobs: int, report: bool, work: Work) -> None:
    """Work through what comes in until the other side is gone. Ctrl-C is the other side's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    warnings.simplefilter("ignore", RuntimeWarning)  # a model that runs away overflows; the outcome says so
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
    """End this process when the one that gives it work is killed: nobody would have the rest of a diagnosis."""
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(OURS)


@contextmanager
def _alone() -> Iterator[None]:
    """Processes that are started here use one thread for linear algebra."""
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
