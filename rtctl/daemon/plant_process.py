"""The process at the plant's end of the link: an emulated machine, a real board, or an FMU.

`python -m rtctl.daemon.plant_process`, started by the supervisor with orders on standard input; or
`rtctl plant CONFIG`.
"""

import contextlib
import os
import sys
from typing import Any

import numpy as np
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon import child, compiling
from rtctl.daemon.server import release
from rtctl.drivers.board import BoardError
from rtctl.loop import generate
from rtctl.loop.records import PLANT_STATUS
from rtctl.machines import Machine, fmu_of
from rtctl.tick import frames

SECOND = 1_000_000_000
MOST_BEHIND = 200  # periods of delay that the emulator catches up; a longer delay is skipped


class Plant:
    """The compiled emulator and its arrays."""

    def __init__(self, machine: Machine, made: generate.Generated, status: Any, out: Any, inp: Any):
        frame = generate.new_frames()
        p, s = np.zeros(1, made.plant_params), np.zeros(1, made.plant_state)
        generate.fill(p[0], machine.plant_diagram.blocks)
        self.status = status
        self.records = (s, frame["tx"], frame["tx_staged"], frame["rx"])  # the emulator's whole state
        arguments: tuple[Any, ...] = (status, p, s, frame["tx"], frame["tx_staged"], frame["rx"], out, inp)
        if machine.config.loop.mode == "lockstep":
            self._entry = made.module.plant_lockstep
        else:
            self._entry = made.module.plant_real
            hold = round(machine.config.safety.link_timeout * SECOND)
            arguments = (*arguments, round(machine.plant_period * SECOND), MOST_BEHIND, hold)
        self._arguments = arguments
        generate.warm(self._entry, self._arguments)

    def run(self) -> None:
        """Emulate until status.stop is set, on the wall clock or in turns with the loop."""
        self._entry(*self._arguments)
        self.status["ended"] = 1


def plant(machine: Machine, made: generate.Generated, link: str, status: Any, out: Any, inp: Any) -> Any:
    """Board, FMU or emulator by the config; its `run()` serves the loop. Raises UserError where it cannot start."""
    if machine.config.driver.kind != "emulated":
        from rtctl.daemon.board_plant import BoardPlant

        return BoardPlant(machine, link, status, out, inp)
    if fmu_of(machine.config) is not None:
        from rtctl.daemon.fmu_plant import FmuPlant

        return FmuPlant(machine, link, status, out, inp)
    return Plant(machine, made, status, out, inp)


def serve(
    machine: Machine, endpoint: str, status: Any, announce: Any, later: tuple[Machine, float] | None = None
) -> None:
    """Listen at a ZeroMQ endpoint and serve the plant; `announce()` is called once the socket listens.

    `later` is a second machine and the time in s after which the emulator continues with it.
    """
    made = generate.generate(machine, "zmq")
    context = zmq.Context()
    link = machine.config.link
    socket = child.link_socket(context, endpoint, True, 1.0, link.keys)
    served = plant(machine, made, "zmq", status, socket.underlying, socket.underlying)
    if later is not None:
        from rtctl.daemon.onset import Onset

        other, seconds = later
        second = Plant(other, generate.generate(other, "zmq"), status, socket.underlying, socket.underlying)
        served = Onset(served, second, seconds)
    announce()
    if machine.config.loop.mode == "lockstep":
        _wait_for_hello(socket, status)
    served.run()
    release(socket, endpoint)
    context.term()


def _wait_for_hello(socket: zmq.Socket, status: Any) -> None:
    """Wait for the hello frame of the loop, or for status.stop: before, nobody would take the first sample."""
    while not status[0]["stop"]:
        if not socket.poll(200, zmq.POLLIN):
            continue
        data = socket.recv()
        if len(data) == frames.OUTPUTS.itemsize:
            hello = np.frombuffer(data, frames.OUTPUTS)[0]
            if hello["magic"] == frames.MAGIC and hello["seq"] == frames.HELLO:
                return


def main() -> int:
    """Serve the plant as ordered by the supervisor; returns the exit code."""
    order = child.orders()
    machine = child.machine_from(order)
    made = generate.generate(machine, order["link"])
    segment = child.segment_from(order, made)
    status = segment["plant_status"]
    status["pid"] = os.getpid()

    def stop() -> None:
        status["stop"] = 1

    compiling.tell()
    child.watch_parent(stop, stop)
    if order.get("cpu") is not None:
        with contextlib.suppress(OSError):  # another CPU only delays samples a little
            os.sched_setaffinity(0, {order["cpu"]})
    if order["link"] == "zmq":
        serve(machine, order["endpoint"], status, lambda: None)
    else:
        plant(machine, made, "shm", status, segment["inputs"], segment["outputs"]).run()
    child.report("ended")
    return 0


def alone(machine: Machine, endpoint: str, announce: Any, later: tuple[Machine, float] | None = None) -> None:
    """Serve the plant for `rtctl plant` until interrupted; `later` as in `serve`."""
    status = np.zeros(1, PLANT_STATUS)

    def stop() -> None:
        status["stop"] = 1

    child.watch_parent(lambda: None, stop, interrupt=True)
    serve(machine, endpoint, status, announce, later)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        child.report("error", message=str(error), code=2)
        sys.exit(2)
    except BoardError as error:  # the loop gets no samples and trips; the supervisor reports this error output
        print(f"{error}; its outputs are off", file=sys.stderr)
        sys.exit(1)
