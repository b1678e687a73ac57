"""Injected faults in a running machine: `rtctl fault add`, `list` and `clear`, and `faults:` of its config.

Faults at the loop's boundary go to the loop by mailbox. Faults of processes are carried out here, at a turn of the
supervisor. On virtual time the loop waits for this turn before the tick of the fault (`status.hold`).
"""

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from rtctl.config import complaints
from rtctl.config.errors import UserError
from rtctl.config.isolated import python
from rtctl.daemon import children
from rtctl.daemon.log import log
from rtctl.tick import faults
from rtctl.trace.recorder import Recorder

if TYPE_CHECKING:
    from rtctl.daemon.supervisor import Supervisor

FLUSH = 5.0  # s of wall clock for which virtual time waits for the recorder, so that a disk is full at a given tick
BUSY = "import os,threading as t; t.Thread(target=lambda: os.read(0, 1) or os._exit(0)).start()\nwhile True: pass"
Undo = Callable[[], None]


class Planned(NamedTuple):
    """A fault of a process, in ticks."""

    name: str
    begin: int
    end: int
    size: float


class Faults:
    """Injected faults of a machine. `told` lists the beginnings and ends of faults of processes, with their ticks."""

    def __init__(self, supervisor: "Supervisor"):
        self._of = supervisor
        self._virtual = supervisor.config.loop.mode != "real"
        wanted = [f for f in supervisor.config.faults if f.fault in faults.PROCESSES]
        self._due = [self._planned(settings, 0) for settings in wanted]
        self._on: list[tuple[Planned, Undo]] = []
        self.told: list[dict[str, Any]] = []
        self._held = 0
        self._hold()

    # the command

    def handle(self, action: str, fault: dict[str, Any] | None) -> dict[str, Any]:
        """Add a fault, with its time counted from now, clear all faults, or list them. Raises UserError."""
        tick = int(self._of.status["tick"])
        if action == "add":
            self._add(self._settings(fault or {}), tick)
        elif action == "clear":
            self._of.order(lambda _, command: faults.fill(command, []))
            self.clear()
        kept = [self._described(f, tick) for f in self._in_force()]
        kept += [_described(p, tick) for p in (*self._due, *(planned for planned, _ in self._on))]
        return {"tick": tick, "faults": kept}

    def _add(self, settings: faults.FaultSettings, tick: int) -> None:
        if settings.fault in faults.PROCESSES:
            self._due.append(self._planned(settings, tick))
            self._hold()
            return
        try:
            kept = [
                *(f for f in self._in_force() if f.end > tick),
                faults.build(settings, self._of.machine.dt, tick, self._of.machine.diagram.blocks),
            ]
        except ValueError as error:
            raise UserError(str(error)) from error
        if len(kept) > faults.SLOTS:
            raise UserError(f"{faults.SLOTS} faults are in force, and that is the most; `rtctl fault clear` first")
        self._of.order(lambda _, command: faults.fill(command, kept))

    def _settings(self, wanted: dict[str, Any]) -> faults.FaultSettings:
        try:
            return faults.FaultSettings.model_validate(wanted)
        except ValidationError as error:
            raise UserError("fault: " + complaints.sentences(error, faults.FaultSettings, wanted)) from error

    def _planned(self, settings: faults.FaultSettings, now: int) -> Planned:
        if settings.fault == "plant.kill" and (self._of.config.loop.mode == "fused" or not self._of.config.link.spawns):
            raise UserError("plant.kill: there is no process of ours to kill: the emulator runs "
                            + ("inside the loop" if self._of.config.loop.mode == "fused" else "elsewhere"))  # fmt: skip
        if settings.fault == "plant.kill" and self._of.config.driver.kind != "emulated":
            raise UserError("plant.kill: a real board's process is not killed: its outputs would stay as they are; "
                            "use link.silent")  # fmt: skip
        if settings.fault in ("recorder.stall", "disk.full") and self._of.out is None:
            raise UserError(f"{settings.fault}: this run records nothing")
        built = faults.build(settings, 1.0 / self._of.config.loop.rate, now)
        return Planned(settings.fault, max(built.begin, 1), built.end, built.size)

    def _in_force(self) -> list[faults.Fault]:
        return faults.in_force(self._of.segment["mailbox"][0]["command"])

    def _described(self, fault: faults.Fault, tick: int) -> dict[str, Any]:
        name = next(name for name, kind in faults.KINDS.items() if kind.number == fault.kind)
        return {**_described(Planned(name, fault.begin, fault.end, fault.size), tick), "channel": fault.channel}

    # faults of processes

    def act(self) -> None:
        """Begin and end the faults of processes that are due. Call at each turn."""
        tick = int(self._of.status["tick"])
        if not any(p.begin <= tick for p in self._due) and not any(p.end <= tick for p, _ in self._on):
            return
        if self._virtual:
            self._of._drain()  # the loop waits, so the recorder gets all earlier rows
        for planned, undo in [entry for entry in self._on if entry[0].end <= tick]:
            self._on.remove((planned, undo))
            undo()
            self._tell(planned.name, "has passed")
        for planned in [p for p in self._due if p.begin <= tick]:
            self._due.remove(planned)
            self._on.append((planned, self._begin(planned)))
        self._hold()

    def clear(self) -> None:
        """End all faults of processes. A killed plant is started again, unless the run stops. May be called again."""
        self._due = []
        while self._on:
            planned, undo = self._on.pop()
            if planned.name != "plant.kill" or not self._of.status["stop"]:
                undo()
        self._hold()

    def _hold(self) -> None:
        """Set the tick before which virtual time has to wait for the next fault."""
        ends = [p.end for p, _ in self._on if p.end != faults.FOR_EVER]
        before = min([*ends, *(p.begin for p in self._due)], default=0)
        if self._virtual and before != self._held:
            self._held = self._of.status["hold"] = before

    def _begin(self, planned: Planned) -> Undo:
        self._tell(planned.name, "begins")
        return getattr(self, "_" + planned.name.replace(".", "_"))(planned)

    def _tell(self, name: str, what: str) -> None:
        tick = int(self._of.status["tick"])
        self.told.append({"fault": name, "tick": tick, "what": what})
        log.warning("fault", name=name, tick=tick, what=what)

    def _plant_kill(self, _: Planned) -> Undo:
        plant = self._of.plant
        assert plant is not None
        plant.process.kill()
        plant.process.wait()
        self._of._plant_died = True  # expected: no warning
        if self._virtual:  # virtual time advances with the plant, so the run ends
            self._of.status["stop"] = 1
            self._tell("plant.kill", "ends the run: virtual time does not pass without the plant")
            return lambda: None
        return self._plant_again

    def _plant_again(self) -> None:
        dead = self._of.plant
        assert dead is not None
        slot = self._of.segment["inputs"][0]
        if slot["count"] % 2:  # it was killed in the middle of a frame
            slot["count"] += 1
        self._of.segment["plant_status"][0]["ended"] = 0
        dead.stop()
        self._of.plant = children.start_child("plant", dead.order)
        self._of.children[self._of.children.index(dead)] = self._of.plant
        self._of._plant_died = False

    def _supervisor_kill(self, _: Planned) -> Undo:
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError("still here")

    def _recorder_stall(self, _: Planned) -> Undo:
        assert self._of.recorder is not None
        bundle, moves = self._of.recorder._bundle, threading.Event()
        write = bundle.write
        vars(bundle)["write"] = lambda rows: moves.wait() and write(rows)

        def undo() -> None:
            del vars(bundle)["write"]
            moves.set()

        return undo

    def _disk_full(self, _: Planned) -> Undo:
        recorder = self._of.recorder
        assert recorder is not None
        deadline = time.monotonic() + FLUSH
        while self._virtual and recorder.stats().rows_queued and time.monotonic() < deadline:
            time.sleep(0.001)
        with Path("/dev/full").open("wb", buffering=0) as full:
            os.dup2(full.fileno(), _file(recorder), inheritable=False)
        return lambda: None

    def _clock_step(self, planned: Planned) -> Undo:
        """Step the clock of this process only, not that of the computer."""
        seconds, nanoseconds = time.time, time.time_ns
        vars(time).update(
            time=lambda: seconds() + planned.size, time_ns=lambda: nanoseconds() + int(planned.size * 1e9)
        )
        return lambda: vars(time).update(time=seconds, time_ns=nanoseconds)

    def _cpu_hog(self, planned: Planned) -> Undo:
        """Start busy processes. Each reads a pipe from this process, and ends with it even after a kill."""
        hogs = [subprocess.Popen(python("-S", "-c", BUSY), stdin=subprocess.PIPE) for _ in range(round(planned.size))]

        def undo() -> None:
            for hog in hogs:
                hog.kill()
            for hog in hogs:
                hog.communicate()

        return undo


def _file(recorder: Recorder) -> int:
    """The file descriptor that the recorder writes its rows to."""
    part: Any = getattr(recorder._bundle, "_part", recorder._bundle)  # the current part of a recording in parts
    return int(part._writer._file)


def _described(planned: Planned, tick: int) -> dict[str, Any]:
    return {
        "fault": planned.name,
        "size": planned.size,
        "begin": planned.begin,
        "end": None if planned.end == faults.FOR_EVER else planned.end,
        "active": planned.begin <= tick < planned.end,
    }
