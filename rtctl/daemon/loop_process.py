"""The loop's process: `python -m rtctl.daemon.loop_process`, started by the supervisor, with orders on standard input.

The Python interpreter runs before and after the compiled loop, and on virtual time between blocks of ticks.
"""

import contextlib
import os
import sys
import time

import zmq

from rtctl.config.errors import UserError
from rtctl.daemon import child, compiling
from rtctl.loop import generate, zmq_link
from rtctl.loop.loop import Loop
from rtctl.loop.realtime import RealTime
from rtctl.tick import frames

FOREVER = 2**62


def main() -> int:
    """Run the loop as ordered and return the exit code; reports `compiling`, `lacks` and `ended`. Raises UserError."""
    order = child.orders()
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

    compiling.tell()
    child.watch_parent(lost, stop)
    over_zmq = order["link"] == "zmq" and loop.mode != "fused"
    run = Loop(machine, made, segment, *((0, 0) if over_zmq else (segment["outputs"], segment["inputs"])))
    if over_zmq:
        zmq_link.load()
    run.warm()  # before the link connects: samples that arrive during compilation would be old
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
        _wait_for_plant(socket, run, order["patience"], order["endpoint"], machine.config.link.keys)
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
    if status[0]["failed"] and not status[0]["stop"]:
        raise UserError(f"the plant at {order['endpoint']} stopped answering at tick {status[0]['tick']}")
    child.report("ended", tick=int(status[0]["tick"]))
    if socket is not None:
        socket.close()
    context.term()
    return 0


def _wait_for_plant(socket: zmq.Socket | None, run: Loop, timeout: float, endpoint: str, key_name: str | None) -> None:
    """Send hello frames until the plant answers. Raises UserError after `timeout` s without an answer."""
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
            return
    if time.monotonic() < deadline:
        return  # stop was ordered
    keys = f"; if it runs, its folder `authorized` lacks our {key_name}.key or our server.key is not its own"
    raise UserError(
        f"no plant answers at {endpoint} within {timeout:g} s (link.timeout); start it with `rtctl plant CONFIG`, "
        "and wait until it says that it listens, or leave link.endpoint out to have one started"
        + (keys if key_name else "")
    )


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        child.report("error", message=str(error), code=2)
        sys.exit(2)
