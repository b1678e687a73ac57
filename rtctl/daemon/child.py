"""Common parts of the loop's and the plant's process: orders, reports, and a watch on the supervisor.

Standard input is a pipe from the supervisor. Its first line are the orders, one JSON object; its end means that the
supervisor is gone. Reports are JSON lines on standard output.
"""

import contextlib
import json
import os
import select
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zmq

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.daemon import keys, server
from rtctl.loop import generate, zmq_link
from rtctl.loop.records import layout
from rtctl.machines import Machine
from rtctl.own.files import trust
from rtctl.tick.memory import Segment

# Frames that a link may queue. ZeroMQ updates the sender's count of queued frames only after every 100 frames received.
# With fewer than 200 frames, a sender in lockstep could take an empty queue for a full one.
LINK_WAITING = 256
# Time in ms without acknowledgement after which a connection is closed and a new one is made. TCP doubles its retry
# intervals, so without this limit the link would stay silent after a cut for as long as the cut lasted.
CUT_MS = 1000


def orders() -> dict[str, Any]:
    """The orders of this process, from standard input. Raises SystemExit where the supervisor ends without any."""
    line = b""
    while not line.endswith(b"\n"):  # no buffer: `watch_parent` waits for the end of the same pipe
        part = os.read(sys.stdin.fileno(), 65536)
        if not part:
            raise SystemExit(0)
        line += part
    return json.loads(line)


def report(event: str, **values: Any) -> None:
    """Send one report to the supervisor, as a JSON line. A supervisor that is gone is no error."""
    with contextlib.suppress(OSError):
        print(json.dumps({"event": event, **values}), flush=True)


def machine_from(order: dict[str, Any]) -> Machine:
    """The machine of an order, which carries its config in full."""
    config = order["config"]
    trust(config.get("own", {}).values())  # from the supervisor of the same user
    return machines.build(machines.settings(config))


def segment_from(order: dict[str, Any], made: generate.Generated) -> Segment:
    """Map the shared memory that the supervisor made. Raises UserError where it belongs to a later supervisor."""
    segment = Segment.open(Path(order["segment"]), layout(made.params, made.tables, made.row, order["rows"]))
    if segment.path.stat().st_ino != order["inode"]:
        raise UserError(f"{segment.path} belongs to another supervisor by now; ours has died")
    return segment


def watch_parent(on_lost: Callable[[], None], on_stop: Callable[[], None], interrupt: bool = False) -> None:
    """Call `on_lost` when the supervisor's pipe ends and `on_stop` on SIGTERM, even while compiled code runs.

    Compiled code does not return to the interpreter, so a Python signal handler would never run. The C handler writes
    to the wake-up file descriptor at once, and a thread reads it here.
    """
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    # Ctrl-C goes to the whole process group: a child ignores it, a process without supervisor (`interrupt`) stops
    signal.signal(signal.SIGINT, (lambda *_: None) if interrupt else signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: on_stop())  # also here, so that an interrupted wait raises no error
    # a closed terminal sends SIGHUP to the whole group: the supervisor ends its children, a plant without one stops
    if not interrupt:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    elif signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # nohup sets SIG_IGN
        signal.signal(signal.SIGHUP, lambda *_: on_stop())
    signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)

    def watch() -> None:
        while True:
            ready, _, _ = select.select([read_end] if interrupt else [sys.stdin.fileno(), read_end], [], [])
            if read_end in ready and os.read(read_end, 64):
                on_stop()
            if not interrupt and sys.stdin.fileno() in ready and not os.read(sys.stdin.fileno(), 4096):
                on_lost()
                return

    threading.Thread(target=watch, name="watch", daemon=True).start()


def link_socket(context: zmq.Context, endpoint: str, bind: bool, timeout: float, key_name: str | None) -> zmq.Socket:
    """Socket at one end of the link: the plant binds, the loop connects. CURVE secures it with a `key_name`.

    Raises UserError for an endpoint that other computers can reach, without a key.
    """
    zmq_link.load()
    socket = context.socket(zmq.DEALER)
    socket.set(zmq.LINGER, 100)
    socket.set(zmq.RECONNECT_IVL, 10)
    socket.set(zmq.TCP_MAXRT, CUT_MS)
    socket.set(zmq.CONNECT_TIMEOUT, CUT_MS)
    socket.set(zmq.HANDSHAKE_IVL, CUT_MS)
    socket.set(zmq.SNDHWM, LINK_WAITING)
    socket.set(zmq.RCVHWM, LINK_WAITING)
    socket.set(zmq.RCVTIMEO, int(timeout * 1000))
    socket.set(zmq.MAXMSGSIZE, 4096)
    if bind:
        server.bind(socket, endpoint, keys.server_curve() if key_name else None)
        return socket
    if key_name:
        curve = keys.client_curve(key_name)
        keys.apply_client(socket, curve.keys, curve.server)
    elif keys.require_curve(endpoint):
        raise keys.refuse_open(endpoint)
    socket.connect(endpoint)
    return socket
