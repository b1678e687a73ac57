"""The supervisor: starts loop and plant, and does all work that is not real-time.

    loop -> ring -> supervisor -> recorder, captures, telemetry, status
    command socket -> supervisor -> mailbox -> loop

It takes a turn every few milliseconds. It never delays the loop: rows that it reads too late are counted as lost.
"""

import contextlib
import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import zmq

from rtctl import machines
from rtctl.config.bounds import Bounds
from rtctl.config.errors import UserError
from rtctl.daemon import ending, shared_memory
from rtctl.daemon.answers import Answers
from rtctl.daemon.captures import Captures
from rtctl.daemon.case import describe
from rtctl.daemon.children import ChildProcess, dismiss, start_child
from rtctl.daemon.commands import Commands
from rtctl.daemon.events import Recording, Trips
from rtctl.daemon.faults import Faults
from rtctl.daemon.lock import MachineLock
from rtctl.daemon.log import log
from rtctl.daemon.notify import Service
from rtctl.daemon.outside import Outside
from rtctl.daemon.reload import reload
from rtctl.daemon.server import runtime_dir
from rtctl.daemon.starting import Starting, ended
from rtctl.daemon.watched import Watched
from rtctl.loop import generate
from rtctl.loop.histogram import account
from rtctl.loop.mailbox import Mailbox
from rtctl.loop.records import STAGES, layout
from rtctl.loop.ring import Reader
from rtctl.own import files as own_files
from rtctl.tick import safety
from rtctl.trace.orders import Journal
from rtctl.trace.recorder import Recorder
from rtctl.trace.rotation import Rotation

TURN_MS = 10  # ms between two turns of the supervisor on the wall clock
FOREVER = 1e9  # s for which a loop waits for the supervisor's plant, which may compile; its death is noticed


class Supervisor(Answers):
    """A running machine. Use as a context: its exit stops the loop with the outputs at zero.

    `out` is the folder of the run's bundle; None records only captures. The run ends after `ticks` ticks, with 0 never.
    `say` gets one-line messages for the person who started the run.
    """

    def __init__(self, config: Any, out: Path | None, ticks: int = 0, say: Callable[[str], None] = lambda _: None):
        self.config, self.out, self.ticks, self.say = config, out, ticks, say
        try:
            self.machine = machines.build(config)
        except ValueError as error:
            raise UserError(f"{config.name}: {error}") from error
        self.bounds = Bounds(config)  # bounds of the file at the start; later changes do not move them
        self.link = "shm" if config.loop.mode == "fused" else config.link.kind
        self.made = generate.generate(self.machine, self.link)
        self.lacks: list[str] = []
        self.armed_at_start = False
        self.interrupted = False  # set by a signal handler, read only between turns
        self.hung_up = False  # set by the handler of SIGHUP: read the config again
        self.reread: Callable[[], Any] | None = None  # returns the settings of the config file as it is now
        self.terminal_gone = False  # set by a signal handler: the terminal was closed
        self.service = Service()
        self._trips, self._recording = Trips(), Recording(say)
        self.changes: list[dict[str, Any]] = []
        self.recorder: Recorder | None = None
        self.failure: Exception | None = None  # why the run ended by itself, once it has
        self._ended = False
        self._stack = contextlib.ExitStack()

    def __enter__(self) -> "Supervisor":
        with contextlib.ExitStack() as stack:
            try:
                self._open(stack)
            except BaseException:
                if self.recorder is not None:
                    self.recorder.abandon()
                raise
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: Any) -> None:
        self.stop()
        self._stack.close()

    def _open(self, stack: contextlib.ExitStack) -> None:
        config, made = self.config, self.made
        stack.enter_context(MachineLock(shared_memory.lock_path(config.name), config.name, runtime_dir()))
        if aside := shared_memory.put_aside(config.name):
            way_on = f"`rtctl trace recover {config.name}` joins them to its recording"
            self.say(f"{config.name}: the last rows of a killed run are kept in {aside}; {way_on}")
        rows = max(int(config.record.seconds * self.machine.rate), 1000)
        path = shared_memory.segment_path(config.name)
        self.segment = shared_memory.create(path, layout(made.params, made.tables, made.row, rows))
        stack.callback(shared_memory.remove, path)  # after a crash it stays, with the last seconds of the trace
        self.status = self.segment["status"][0]
        self.mailbox = Mailbox(self.segment)
        self.reader = Reader(self.segment)
        generate.prepare(self.segment, self.machine)
        self.journal = Journal()
        stack.callback(self.journal.close)
        if self.armed_at_start:
            self.order(_arm_and_play)  # before the first tick, so that a virtual run is repeatable to the bit
        self.faults = Faults(self)
        self.watched = Watched()
        self.commands = Commands(self)
        self.outside = Outside(config, [column.name for column in made.columns], made.row, self.commands)
        stack.callback(self.outside.close)
        self.server = self.outside.server
        self.case = describe(self.machine, made)
        self.captures = Captures(self.machine.rate, made.columns, made.row, self.case)
        stack.callback(self.captures.close)
        if self.out is not None:
            try:
                self.recorder = Recorder(
                    self.out, made.columns, made.row, self.case, batch=max(config.record.batch - 2e-3 * TURN_MS, 0.0),
                    rotation=Rotation(config.record.rotate_mb, config.record.rotate_minutes),
                )  # fmt: skip
                self.journal.open(self.out)
                own_files.keep(config.own, self.out)
            except OSError as error:
                raise UserError(f"{self.out}: cannot record here: {error.strerror}") from error
        case = self.case if self.recorder is None else self.recorder.case
        shared_memory.describe(self.segment, made.columns, case, self.out)
        if config.metrics.port is not None:
            from rtctl.daemon import metrics  # imported here: slow to load and seldom used

            stack.callback(metrics.serve(self, config.metrics.port))
        self._start_children(stack, rows)

    def _start_children(self, stack: contextlib.ExitStack, rows: int) -> None:
        config, link = self.config, self.config.link
        endpoint = link.endpoint or f"ipc://{runtime_dir() / f'{config.name}.plant'}"
        cpus = sorted(os.sched_getaffinity(0))
        others = [c for c in cpus if c != (config.loop.cpu if config.loop.cpu is not None else cpus[-1])]
        order = {
            "config": config.model_dump(mode="json", exclude_unset=True),
            "segment": str(self.segment.path),
            "inode": self.segment.path.stat().st_ino,  # a child that outlives this process must not use a later segment
            "rows": rows,
            "link": self.link,
            "endpoint": endpoint,
            "ticks": self.ticks,
            "patience": link.timeout,
            "cpu": others[0] if others else None,
        }
        entry = {"real": "run_real", "lockstep": "run_lockstep", "fused": "run_fused"}[config.loop.mode]
        if not generate.is_warm(self.made.path, entry):
            self.say("compiling the tick, once for this config structure; half a minute or so ...")
        self.children: list[ChildProcess] = []
        self.plant: ChildProcess | None = None
        stack.callback(self._stop_children)
        if config.loop.mode != "fused" and link.spawns:
            self.plant = start_child("plant", order)
            self.children.append(self.plant)
            order["patience"] = FOREVER
        self.loop = start_child("loop", order)
        self.children.append(self.loop)
        dismiss()
        self._wait_for_first_tick()

    def _wait_for_first_tick(self) -> None:
        self._starting = starting = Starting(self.children, self.say)
        while not self.status["ready"] and not self.status["ended"]:
            if self.interrupted:
                raise KeyboardInterrupt
            self._beat()
            self.commands.heard()  # nobody can command before the first tick
            self._hear()
            for child in self.children:
                if not child.running() and not self.status["ready"] and not self.status["ended"]:
                    self._hear()
                    if child is self.plant and self.config.driver.kind != "emulated":
                        raise UserError(f"driver: {ended(child)}")
                    what = f"the {child.role} process ended while it started: {ended(child)}"
                    raise UserError(what) if (child.process.poll() or 0) < 0 else RuntimeError(what)
            starting.look()
            time.sleep(0.002)

    def _hear(self) -> None:
        """Read the reports of the children: compilation, missing rights. Raises UserError for a reported error."""
        for child in self.children:
            for report in child.reports():
                if report["event"] == "error":
                    raise UserError(report["message"])
                if report["event"] == "compiling" and self._starting is not None:
                    self._starting.compiling[child.role] = report["what"]
                if report["event"] == "lacks":
                    self.lacks = report["lacks"]
                    self.say("not fully real-time here: " + " | ".join(self.lacks))

    # one turn

    def turn(self) -> bool:
        """Read rows, record, publish and answer. Returns False once the loop has ended and all its rows are read."""
        self._beat()
        over = bool(self.status["ended"]) or not self.loop.running()
        self._drain()
        self._recording.look(None if self.recorder is None else self.recorder.trouble)
        self.faults.act()
        self.outside.look()
        self.commands.watch_commander()
        if not self._ended:
            self._fail(ending.reported(self._hear))
        if self.service.listens:
            self._tell_service()
        if self.hung_up:
            self._reload()
        if over and not self._ended:
            self._ended = True
            self._drain()
            self._fail(ending.failure(self.loop, self.status, self._hear))
        if self.plant is not None and not self._ended and not self.plant.running() and not self._plant_died:
            self._plant_died = True
            log.warning("plant ended", last_words=self.plant.last_words())
            if self.config.driver.kind != "emulated":
                self._board_off()
        return not self._ended

    def _fail(self, why: Exception | None) -> None:
        """Stop the run for the failure `why`. All rows are still recorded; the session then raises `failure`."""
        if why is not None and self.failure is None:
            self.failure = why
            self.status["stop"] = 1
            log.error("the run failed", why=str(why), tick=int(self.status["tick"]))

    def _beat(self) -> None:
        """Write the heartbeat time: the loop sees that the supervisor runs and can take a disarm."""
        self.status["heartbeat_ns"] = time.monotonic_ns()

    _starting: Starting | None = None
    _plant_died = False

    def _board_off(self) -> None:
        """Set the outputs of a real board to zero after its process has ended: a killed process leaves them on."""
        from rtctl.daemon.board_plant import zero

        assert self.plant is not None
        trouble = zero(self.config)
        now = f"ITS OUTPUTS MAY BE ON, switch the power off: {trouble}" if trouble else "its outputs are zero"
        self.say(f"the board's process ended: {self.plant.last_words() or 'killed'}; {now}")

    def _drain(self) -> None:
        while True:
            rows = self.reader.take(65536)
            for first, count in self.reader.gaps:
                if self.recorder is not None:
                    self.recorder.note_lost(first, count)
                self.captures.note_lost(first, count)
                log.warning("rows lost between loop and supervisor", first=first, count=count)
            if not len(rows):
                return
            self.last_row = rows[-1]
            self._trips.feed(rows)
            self.captures.feed(rows)
            if self.recorder is not None:
                self.recorder.put(rows)
            self.outside.publish(rows)

    def run(self) -> Iterator[None]:
        """Take turns until the run ends; yields after each turn, so that the caller can show a status line."""
        virtual = self.config.loop.mode != "real"
        poller = zmq.Poller()
        poller.register(self.server.socket, zmq.POLLIN)
        while self.turn() and not self.interrupted:
            yield
            self._answer(poller, 1 if virtual else TURN_MS)

    def _answer(self, poller: zmq.Poller, wait_ms: int) -> None:
        """Answer commands as they come for `wait_ms` ms, without a turn for each command."""
        end = time.monotonic() + wait_ms / 1000
        while not self.interrupted and (left := end - time.monotonic()) > 0 and poller.poll(math.ceil(left * 1000)):
            self.server.process()

    # the service manager

    def _tell_service(self) -> None:
        s = self.status
        self.service.observe(int(s["tick"]), int(s["late"]) + int(s["missed"]))
        trip = f": {safety.TRIPS[int(s['trip'])][1]}" if s["trip"] else ""
        lacks = "".join(f"; {lack.partition(':')[0]}" for lack in self.lacks)
        self.service.status(f"{safety.STATES[int(s['state'])]}{trip}{lacks}")

    def _reload(self) -> None:
        """Read the config again. Errors in it are logged, and the old values stay."""
        self.hung_up = False  # cleared before the read: a later SIGHUP asks for another read
        self.service.reloading()
        try:
            if self.reread is None:
                raise UserError("this machine has no config file to read again")
            taken, refused = reload(self, self.reread())
        except UserError as error:
            taken, refused = [], [f"the config is not taken over, all old values stay: {error}"]
        for sentence in refused:
            log.warning("reload", refused=sentence)
        log.info("reload", taken=taken)
        self.service.reloaded()

    def order(self, write: Callable[[Any, Any], None], changed: dict[str, Any] | None = None) -> None:
        """Post the changes of `write(params, command)` and keep them for a replay; `changed` are settings by path."""
        self.mailbox.post(write)
        self.journal.note(self.segment["mailbox"][0]["command"], changed or {})

    def note_change(self, path: str, value: Any) -> None:
        """Keep a setting that was changed during the run, for the bundle."""
        self.changes.append({"tick": int(self.status["tick"]), "path": path, "value": value})

    def stop(self) -> None:
        """End the loop with its outputs at zero and read its last rows."""
        self.service.stopping()
        if hasattr(self, "status"):
            self.status["stop"] = 1
        if hasattr(self, "faults"):
            self.faults.clear()
        deadline = time.monotonic() + 5.0
        while hasattr(self, "loop") and not self._ended and time.monotonic() < deadline:
            try:
                if not self.turn():
                    break
            except (RuntimeError, UserError) as error:
                log.error("while stopping", error=str(error))
                break
            time.sleep(0.002)

    def finish(self) -> Path | None:
        """Close the recording; returns the bundle's folder, which may have been renamed. Raises OSError."""
        if self.recorder is None:
            return None
        timing = {stage: account(self.status[field]) for stage, field in STAGES.items()}
        folder = self.recorder.finish({"run": self.snapshot(), "timing": timing, "changes": self.changes})
        self._recording.look(self.recorder.trouble)
        if self.recorder.trouble:
            self.journal.follow(folder)
            own_files.keep(self.config.own, folder)
        return folder

    def _stop_children(self) -> None:
        self.segment["plant_status"][0]["stop"] = 1
        self.status["stop"] = 1
        started = bool(self.status["ready"])  # a compiling child does not react, and its outputs are off
        for child in reversed(self.children):
            child.stop() if started else child.stop(0.5)


def _arm_and_play(_: Any, command: Any) -> None:
    command["arm"] += 1
    command["play"] += 1
