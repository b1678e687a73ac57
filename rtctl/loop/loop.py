"""The compiled loop and its arrays, for any process that runs it."""

import time
from typing import Any

import numpy as np

from rtctl.loop import generate, mailbox
from rtctl.loop.records import MARKS
from rtctl.machines import Machine
from rtctl.tick import faults
from rtctl.tick.memory import Segment

STRETCH = 20_000  # most ticks of virtual time between two checks of the ring's reader
SECOND = 1_000_000_000


class Loop:
    """The compiled loop with its arrays, and the three modes to run it."""

    def __init__(
        self, machine: Machine, made: generate.Generated, segment: Segment | dict[str, Any], out: Any, inp: Any
    ):
        self.machine, self.made, self.segment = machine, made, segment
        self.out, self.inp = out, inp
        frame = generate.new_frames()
        self.tx, self.rx, self.rx_staged, self.held = frame["tx"], frame["rx"], frame["rx_staged"], frame["tx_held"]
        self.m, self.f = np.zeros(1, MARKS), np.zeros(1, faults.FAULTS_STATE)
        self.f["seed"] = machine.config.loop.seed
        self.p, self.s = np.zeros(1, made.params), np.zeros(1, made.state)
        self.c, self.y = np.zeros(1, mailbox.COMMAND), np.zeros(1, made.row)
        faults.fill(self.c[0], machine.faults)
        self.staged = np.zeros(1, mailbox.mailbox_dtype(made.params))
        self.pp, self.ps = np.zeros(1, made.plant_params), np.zeros(1, made.plant_state)
        generate.fill(self.p[0], machine.diagram.blocks)
        generate.fill(self.pp[0], machine.plant_diagram.blocks)
        self.status = segment["status"]
        self.shared = (self.status, segment["mailbox"], segment["tables"], segment["ring"], segment["rows"])
        self.own = (self.p, self.s, self.c, self.staged, self.y, self.m, self.f, self.tx, self.rx, self.held)
        self.period = round(SECOND / machine.rate)
        self.ahead = int(machine.config.loop.write == "next_tick")

    def entry(self) -> tuple[Any, tuple[Any, ...]]:
        """The compiled function of the mode and its arguments.

        The last argument (most ticks), and on virtual time the one before (first tick), are 0 and must be set.
        """
        loop, module = self.machine.config.loop, self.made.module
        timing = (self.period, int(loop.late * self.period), self.ahead)
        if loop.mode == "fused":
            return module.run_fused, (*self.shared, *self.own, self.pp, self.ps, *timing, 0, 0)
        linked = (*self.shared, *self.own, self.rx_staged, self.out, self.inp, *timing)
        if loop.mode == "real":
            return module.run_real, (*linked, int(loop.spin * SECOND), 0)
        return module.run_lockstep, (*linked, 0, 0)

    def warm(self) -> None:
        """Compile the loop, before samples or commands wait for it."""
        generate.warm(*self.entry())

    def real(self, ticks: int) -> None:
        """Run at most `ticks` ticks on the wall clock."""
        run, arguments = self.entry()
        run(*arguments[:-1], ticks)

    def stretch(self, first: int, most: int) -> None:
        """Run at most `most` ticks of virtual time from tick `first` on, with the plant fused or in lockstep."""
        run, arguments = self.entry()
        run(*arguments[:-2], first, most)

    def virtual(self, ticks: int) -> None:
        """Run `ticks` ticks of virtual time in blocks, no further than the ring has room: no row is lost."""
        status, ring = self.status[0], self.segment["ring"][0]
        room = len(self.segment["rows"]) - 1  # in a full ring the reader drops the oldest row, which may be torn
        done = 0
        while done < ticks and not status["stop"] and not status["supervisor_lost"] and not status["failed"]:
            free = room - int(ring["head"] - ring["tail"])
            hold = int(status["hold"])
            most = min(ticks - done, STRETCH, free, hold - done if hold else STRETCH)
            if most <= 0:
                time.sleep(0.0005)  # wait for the reader, or for a fault of a process (hold)
                continue
            self.stretch(done, most)
            done = int(status["tick"])
        status["ended"] = 1
