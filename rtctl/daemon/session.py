"""A run from start to end: supervise, arm, play the reference, record, and return the results."""

import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import structlog

from rtctl.config.errors import RunFailed, UserError
from rtctl.daemon.notify import from_environment
from rtctl.daemon.supervisor import Supervisor

MOST_ROWS = 3_000_000  # longest run with step metrics and picture; draw part of a longer one with `rtctl trace plot`


class Session:
    """One `rtctl run` of `length` s; None runs until `stop` or Ctrl-C.

    `reread()` returns the settings of the config file as it is now; a service manager asks for a reload with SIGHUP.
    """

    def __init__(
        self,
        config: Any,
        out: Path | None,
        length: float | None,
        arm: bool = True,
        say: Callable[[str], None] = lambda _: None,
        reread: Callable[[], Any] | None = None,
    ):
        ticks = 0 if length is None else max(1, round(length * config.loop.rate))
        if config.loop.mode == "fused" and not ticks:
            raise UserError("a fused run has no wall clock to follow: say how long with --for")
        self.config, self.arm, self.say = config, arm, say
        if not structlog.is_configured():  # log to standard error: standard output is for the caller
            structlog.configure(logger_factory=lambda *_: structlog.PrintLogger(sys.stderr))
        self.supervisor = Supervisor(config, out, ticks, say)
        self.supervisor.reread = reread
        self.supervisor.service = from_environment(rate=config.loop.rate)
        self.bundle: Path | None = None
        self.steps: list[dict[str, Any]] = []
        self.result: dict[str, Any] | None = None  # there once the recording is finished

    def run(self, update: Callable[[Supervisor], None] = lambda _: None) -> dict[str, Any]:
        """Run to the end; `update` is called at every turn. Returns the results that `rtctl run --json` prints.

        Raises RunFailed where the loop's process died, UserError where a process reported an error. The recording is
        finished and `result` is set also after a failure.
        """
        supervisor = self.supervisor
        supervisor.armed_at_start = self.arm
        with _signals(supervisor), supervisor:
            for _ in supervisor.run():
                update(supervisor)
            supervisor.stop()
            try:
                self.bundle = supervisor.finish()
            except OSError as error:
                raise UserError(_not_taken(supervisor, error)) from error
            result = supervisor.snapshot()  # after all rows are on disk
        self.steps = self._metrics()
        self.result = {
            **result,
            "steps": self.steps,
            "tripped": result["trip"]["code"] if result["trip"] else None,
            "interrupted": supervisor.interrupted,
            "lost_rows": lost_rows(result["rows"]),
            "bundle": str(self.bundle) if self.bundle else None,
        }
        if supervisor.failure is not None:
            raise supervisor.failure
        return self.result

    def _rows(self) -> int:
        """Number of rows in the bundle: 0 where the run ended before its first tick."""
        recorder = self.supervisor.recorder
        return 0 if recorder is None else recorder.stats().rows_written

    def _metrics(self) -> list[dict[str, Any]]:
        if self.bundle is None or not 0 < self._rows() <= MOST_ROWS:
            return []
        from rtctl.trace.bundle import load_bundle
        from rtctl.trace.metrics import machine_steps

        trace = load_bundle(self.bundle).columns
        machine = self.supervisor.machine
        running = trace["state"] == 2
        if running.sum() < 2:
            return []
        t, target, y = (trace[name][running] for name in ("t", "target", machine.signals.position))
        return machine_steps(machine, t, target, y)

    def draw(self) -> str | None:
        """Draw the run into its bundle; returns the picture's path, None without a picture."""
        if self.bundle is None or not 0 < self._rows() <= MOST_ROWS:
            return None
        from rtctl.trace.bundle import load_bundle
        from rtctl.trace.plot import plot_run

        path = self.bundle / "run.png"
        plot_run(load_bundle(self.bundle), self.steps, path)
        return str(path)


def _not_taken(supervisor: Supervisor, error: OSError) -> str:
    """Error message for a recording that could not be completed on the disk."""
    where = supervisor.out if supervisor.recorder is None else supervisor.recorder.folder
    way_on = f"make room, then `rtctl trace repair {where}`"
    if where is not None and not where.exists():
        way_on = "its folder was deleted meanwhile and the rows could not be rescued: they are lost"
    return f"{where}: the disk did not take the recording ({error.strerror or error}); {way_on}"


def whole(result: dict[str, Any]) -> dict[str, Any]:
    """Result of a complete run, for a program that continues with its recording.

    Raises KeyboardInterrupt where the run was interrupted, RunFailed where the recording stopped or was moved.
    """
    if result["interrupted"]:
        raise KeyboardInterrupt
    if error := result["rows"].get("error"):
        raise RunFailed(f"recording: {error}")
    return result


def lost_rows(rows: dict[str, Any]) -> int:
    """Number of rows of a run that are in no recording; without a recorder the rows that the ring lost."""
    return int(rows.get("lost", rows["lost_in_ring"]))


@contextlib.contextmanager
def _signals(supervisor: Supervisor) -> Iterator[None]:
    """Signal handlers: Ctrl-C, SIGTERM and a closed terminal end the run at its next turn; a second Ctrl-C at once.

    SIGHUP makes a service read its config again. An ignored SIGHUP, as under nohup, stays ignored.

    The handlers raise no exception at first: it could leave a lock of the recorder taken, and the recording unfinished.
    """

    noted = False

    def note(*_: Any) -> None:
        nonlocal noted
        if noted:
            raise KeyboardInterrupt
        noted = supervisor.interrupted = True

    def reload(*_: Any) -> None:
        supervisor.hung_up = True

    def closed(*_: Any) -> None:  # SIGHUP comes more than once, from the kernel and from the shell
        supervisor.terminal_gone = supervisor.interrupted = True

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = dict.fromkeys((signal.SIGINT, signal.SIGTERM), note)
    if supervisor.service.listens:
        handlers[signal.SIGHUP] = reload
    elif signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        handlers[signal.SIGHUP] = closed
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
