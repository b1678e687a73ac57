"""Load beside a loop: a busy process on every CPU, viewers of its rows, and clients with requests.

    python benchmarks/stress.py NAME [--viewers N] [--clients N]     until it is stopped

`busy()` is load for any benchmark; `asked(NAME)` is load for a daemon.
"""

import argparse
import contextlib
import itertools
import os
import subprocess
import sys
import time
from collections.abc import Iterator

VIEWERS, CLIENTS = 4, 200
PERIOD = 1.0  # s, interval between requests of a client
SPIN = "while True: pass"


@contextlib.contextmanager
def busy() -> Iterator[None]:
    """Busy process of usual priority on every CPU."""
    with ended([[sys.executable, "-c", SPIN] for _ in os.sched_getaffinity(0)]):
        yield


@contextlib.contextmanager
def asked(name: str) -> Iterator[None]:
    """Viewers and clients of the machine `name`, started when it answers."""
    with ended([[sys.executable, __file__, name]]):
        yield


@contextlib.contextmanager
def ended(commands: list[list[str]]) -> Iterator[None]:
    """Run commands as processes that end with the block."""
    running = [subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for command in commands]
    try:
        yield
    finally:
        for process in running:
            process.kill()
        for process in running:
            process.wait()


def main() -> None:
    """Run viewers that read all rows, and clients that request the status in turn."""
    import zmq

    from rtctl.config.errors import UserError
    from rtctl.daemon.client import Client
    from rtctl.daemon.server import default_endpoint

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name")
    parser.add_argument("--viewers", type=int, default=VIEWERS)
    parser.add_argument("--clients", type=int, default=CLIENTS)
    given = parser.parse_args()
    viewers = []
    for _ in range(given.viewers):
        viewer = zmq.Context.instance().socket(zmq.SUB)
        viewer.subscribe(b"")
        viewer.connect(default_endpoint(given.name, "rows"))
        viewers.append(viewer)
    clients = [Client(default_endpoint(given.name, "command")) for _ in range(given.clients)]
    for client in itertools.cycle(clients):
        begun = time.monotonic()
        with contextlib.suppress(UserError):
            client.call("status")
        for viewer in viewers:
            with contextlib.suppress(zmq.Again):
                while True:
                    viewer.recv_multipart(zmq.NOBLOCK)
        time.sleep(max(PERIOD / given.clients - (time.monotonic() - begun), 0.0))


if __name__ == "__main__":
    main()
