"""The compiled loop and all arrays that it works on, in whatever process it runs."""

import time
from typing import Any

import numpy as np

from rtctl.loop import generate, mailbox
from rtctl.loop.records import MARKS
from rtctl.machines import Machine
from rtctl.tick import faults
from rtctl.tick.memory import Segment

STRETCH = 20_000  # ticks of virtual time between two looks at the ring's reader
SECOND = 1_000_000_000


class Loop:
    """All arrays that the compiled loop works on, and the three ways to run it."""

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
        """The compiled function of this mode and its arguments, but for the last two of a virtual one."""
        loop, module = self.machine.config.loop, self.made.module
        timing = (self.period, int(loop.late * self.period), self.ahead)
        if loop.mode == "fused":
            return module.run_fused, (*self.shared, *self.own, self.pp, self.ps, *timing, 0, 0)
        linked = (*self.shared, *self.own, self.rx_staged, self.out, self.inp, *timing)
        if loop.mode == "real":
            return module.run_real, (*linked, int(loop.spin * SECOND), 0)
        return module.run_lockstep, (*linked, 0, 0)

    def warm(self) -> None:
        """Compile, before anything waits for us."""
        generate.warm(*self.entry())

    def real(self, ticks: int) -> None:
        """On the wall clock, to the end."""
        run, arguments = self.entry()
        run(*arguments[:-1], ticks)

    def stretch(self, first: int, most: int) -> None:
        """A stretch of virtual time, with the plant inside or in turns with its process."""
        run, arguments = self.entry()
        run(*arguments[:-2], first, most)

    def virtual(self, ticks: int) -> None:
        """Stretches of virtual time, never further than the ring's reader can follow: nothing is lost."""
        status, ring = self.status[0], self.segment["ring"][0]
        room = len(self.segment["rows"]) - 1  # the reader gives up the oldest row of a full ring: it may be torn
        done = 0
        while done < ticks and not status["stop"] and not status["supervisor_lost"] and not status["failed"]:
            free = room - int(ring["head"] - ring["tail"])
            hold = int(status["hold"])
            most = min(ticks - done, STRETCH, free, hold - done if hold else STRETCH)
            if most <= 0:
                time.sleep(0.0005)  # the reader is behind, or something is to be done first; virtual time waits for it
                continue
            self.stretch(done, most)
            done = int(status["tick"])
        status["ended"] = 1
