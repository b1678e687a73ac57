"""What the loop's and the plant's process have in common: their orders, their reports, and a watch on their parent.

Orders are one JSON object on the command line. Reports are JSON lines on standard output. Standard input is a pipe
from the supervisor that carries nothing: its end means that the supervisor is gone.
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

# Frames a link may hold. ZeroMQ learns what has left its queue only now and then, every 100 frames received at the
# latest: fewer than twice that, and in lockstep a frame could find a queue full that has long been empty.
LINK_WAITING = 256
# TCP tries again after intervals that double, and would be silent after a cut for as long as the cut was. What has not
# been acknowledged for this long is given up, and a new connection is made; shorter cuts cost nothing but time.
CUT_MS = 1000


def orders(argv: list[str]) -> dict[str, Any]:
    """The orders of this process, from its command line."""
    return json.loads(argv[1])


def report(event: str, **values: Any) -> None:
    """Tell the supervisor, one line at a time. A supervisor that is gone is not an error here."""
    with contextlib.suppress(OSError):
        print(json.dumps({"event": event, **values}), flush=True)


def machine_from(order: dict[str, Any]) -> Machine:
    """The machine of an order, which carries its config in full."""
    config = order["config"]
    trust(config.get("own", {}).values())  # from the supervisor of the same user
    return machines.build(machines.settings(config))


def segment_from(order: dict[str, Any], made: generate.Generated) -> Segment:
    """Map the shared memory that the supervisor made. Raises UserError where a later supervisor has made another."""
    segment = Segment.open(Path(order["segment"]), layout(made.params, made.tables, made.row, order["rows"]))
    if segment.path.stat().st_ino != order["inode"]:
        raise UserError(f"{segment.path} belongs to another supervisor by now; ours has died")
    return segment


def watch_parent(on_lost: Callable[[], None], on_stop: Callable[[], None], interrupt: bool = False) -> None:
    """Call `on_lost` when the supervisor's pipe ends and `on_stop` on SIGTERM, even while compiled code runs.

    Compiled code never returns to the interpreter, so a Python signal handler would wait for ever; the wake-up file
    descriptor is written by the C handler at once and read here, in a thread of its own.
    """
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    # Ctrl-C goes to the whole group: a child leaves it to the supervisor, a process of its own (`interrupt`) stops
    signal.signal(signal.SIGINT, (lambda *_: None) if interrupt else signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: on_stop())  # here too: a wait that it cuts short is no fault
    # a terminal that closes sends it to the whole group: the supervisor ends its children, a plant by itself stops
    if not interrupt:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    elif signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # which nohup has set
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
    """One end of the link: the plant binds, the loop connects. Secured by CURVE where it leaves this machine."""
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
