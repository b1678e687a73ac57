"""The loop's process: `python -m rtctl.daemon.loop_process ORDERS`, started by the supervisor.

Python runs before and after the compiled loop and, on virtual time, between its stretches; never during them.
"""

import contextlib
import os
import sys
import time
from typing import Any

import numpy as np
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon import child
from rtctl.loop import frames, generate, mailbox, zmq_link
from rtctl.loop.memory import Segment
from rtctl.loop.realtime import RealTime
from rtctl.machines import Machine

STRETCH = 20_000  # ticks of virtual time between two looks at the ring's reader
FOREVER = 2**62
SECOND = 1_000_000_000


class Loop:
    """All arrays that the compiled loop works on, and the three ways to run it."""

    def __init__(self, machine: Machine, made: generate.Generated, segment: Segment, out: Any, inp: Any):
        self.machine, self.made, self.segment = machine, made, segment
        self.out, self.inp = out, inp
        frame = generate.new_frames()
        self.tx, self.rx, self.rx_staged, self.held = frame["tx"], frame["rx"], frame["rx_staged"], frame["tx_held"]
        self.p, self.s = np.zeros(1, made.params), np.zeros(1, made.state)
        self.c, self.y = np.zeros(1, mailbox.COMMAND), np.zeros(1, made.row)
        self.staged = np.zeros(1, mailbox.mailbox_dtype(made.params))
        self.pp, self.ps = np.zeros(1, made.plant_params), np.zeros(1, made.plant_state)
        generate.fill(self.p[0], machine.diagram.blocks)
        generate.fill(self.pp[0], machine.plant_diagram.blocks)
        self.status = segment["status"]
        self.shared = (self.status, segment["mailbox"], segment["tables"], segment["ring"], segment["rows"])
        self.own = (self.p, self.s, self.c, self.staged, self.y, self.tx, self.rx)
        self.period = round(SECOND / machine.rate)
        self.ahead = int(machine.config.loop.write == "next_tick")

    def entry(self) -> tuple[Any, tuple[Any, ...]]:
        """The compiled function of this mode and its arguments, but for the last two of a virtual one."""
        loop, module = self.machine.config.loop, self.made.module
        if loop.mode == "real":
            late = int(loop.late * self.period)
            return module.run_real, (
                *self.shared, *self.own, self.rx_staged, self.out, self.inp, self.period, int(loop.spin * SECOND), late,
                self.ahead, 0,
            )  # fmt: skip
        if loop.mode == "lockstep":
            return module.run_lockstep, (
                *self.shared, *self.own, self.rx_staged, self.held, self.out, self.inp, self.period, self.ahead, 0, 0
            )  # fmt: skip
        return module.run_fused, (
            *self.shared, *self.own, self.held, self.pp, self.ps, self.period, self.ahead, 0, 0
        )  # fmt: skip

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
            most = min(ticks - done, STRETCH, free)
            if most <= 0:
                time.sleep(0.0005)  # the reader is behind; virtual time waits for it
                continue
            self.stretch(done, most)
            done = int(status["tick"])
        status["ended"] = 1


def main(argv: list[str]) -> int:
    """Run the loop as ordered; reports `ready`, `lacks`, `error` and `ended`."""
    order = child.orders(argv)
    machine = child.machine_from(order)
    loop = machine.config.loop
    made = generate.generate(machine, order["link"])
    segment = child.segment_from(order, made)
    status = segment["status"]
    status["pid"] = os.getpid()

    def lost() -> None:
        status["supervisor_lost"] = 1

    def stop() -> None:
        status["stop"] = 1

    child.watch_parent(lost, stop)
    over_zmq = order["link"] == "zmq" and loop.mode != "fused"
    run = Loop(machine, made, segment, *((0, 0) if over_zmq else (segment["outputs"], segment["inputs"])))
    if over_zmq:
        zmq_link.load()
    run.warm()  # before the link is up: samples that wait while we compile would be old
    context = zmq.Context()
    socket = None
    if over_zmq:
        link = machine.config.link
        socket = child.link_socket(context, order["endpoint"], False, link.timeout, link.keys)
        run.out = run.inp = socket.underlying
    ticks = order["ticks"] or FOREVER
    if loop.mode == "fused":
        run.virtual(ticks)
    else:
        _wait_for_plant(socket, run, order["patience"], order["endpoint"], loop.mode)
        if loop.mode == "lockstep":
            run.virtual(ticks)
        else:
            realtime = RealTime(loop.priority, loop.cpu) if loop.realtime != "off" else None
            if realtime is not None and realtime.lacks:
                child.report("lacks", lacks=[str(lack) for lack in realtime.lacks])
                if loop.realtime == "required":
                    raise UserError("loop.realtime is 'required' and this machine does not allow it: "
                                    + "; ".join(map(str, realtime.lacks)))  # fmt: skip
            run.real(ticks)
    if status[0]["failed"]:
        raise UserError(f"the plant at {order['endpoint']} stopped answering at tick {status[0]['tick']}")
    child.report("ended", tick=int(status[0]["tick"]))
    if socket is not None:
        socket.close()
    context.term()
    return 0


def _wait_for_plant(socket: zmq.Socket | None, run: Loop, timeout: float, endpoint: str, mode: str) -> None:
    """Say hello until the plant answers. Raises UserError where it does not."""
    deadline = time.monotonic() + timeout
    hello = generate.new_frames()["tx"]
    hello["seq"] = frames.HELLO
    while time.monotonic() < deadline and not run.status[0]["stop"] and not run.status[0]["supervisor_lost"]:
        if socket is None:
            if int(run.inp[0]["count"]) > 0:
                return
            time.sleep(0.001)
            continue
        with contextlib.suppress(zmq.Again):
            socket.send(hello.tobytes(), zmq.DONTWAIT)
        if socket.poll(200, zmq.POLLIN):
            if mode == "real":  # what waited for us is old by now
                while socket.poll(0):
                    socket.recv()
                if not socket.poll(200):
                    continue
            return
    if time.monotonic() < deadline:
        return  # told to stop
    raise UserError(
        f"no plant answers at {endpoint} within {timeout:g} s (link.timeout); start it with `rtctl plant CONFIG`, "
        "or leave link.endpoint out to have one started"
    )


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv))
    except UserError as error:
        child.report("error", message=str(error), code=2)
        sys.exit(2)
