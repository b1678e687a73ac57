"""Effect of a thousand commands a second on the loop: lateness with and without commands, within one run.

    python benchmarks/commands.py [--json] [--machine ldu|ivu] [--seconds S] [--window S] [--rate N]

A machine runs in real mode. Windows with and without commands alternate, so that other load affects both equally. A
command is a setpoint: it goes through the socket, the supervisor and the mailbox into the tick, and its answer is read.
Lateness of every tick comes from the recording of the run. The ratio of a pair of windows is with over without
commands; the result is the median over the pairs.
"""

import argparse
import contextlib
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

CONFIGS = Path(__file__).parents[1] / "configs"
SHARES = {"p50": 0.5, "p99": 0.99, "p999": 0.999}
EDGE = 0.1  # s, excluded at each end of a window: commands start or stop there
START = 180.0  # s, time limit of the start; an empty cache compiles


class Window(NamedTuple):
    commands: int  # commands sent
    answered: int
    refused: int
    first: int  # first tick
    last: int


def rtctl_command() -> tuple[str, ...]:
    """The `rtctl` beside this Python, or the one on the path."""
    beside = Path(sys.executable).parent / "rtctl"
    return (str(beside),) if beside.exists() else ("rtctl",)


@contextlib.contextmanager
def running(machine: str, out: Path) -> Iterator[Any]:
    """Running machine and a client; at the end the machine stops and its recording is finished."""
    from rtctl.config.errors import UserError
    from rtctl.daemon.client import Client
    from rtctl.daemon.server import find_endpoint

    name = f"commands-{os.getpid()}"
    command = (
        *rtctl_command(), "run", str(CONFIGS / f"{machine}.yaml"), "--mode", "real", "--link", "shm", "--json",
        "--no-plot", "--out", str(out), "--set", f"name={name}", "--set", "safety.missed_ticks=0",
        "--set", "safety.link_timeout=5",
    )  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})  # keeps this process off the CPU of the loop
    try:
        with Client(find_endpoint(name, "command"), timeout=5.0) as client:
            deadline = time.monotonic() + START
            while True:
                with contextlib.suppress(UserError):
                    if client.call("status")["state"] == "running":
                        break
                if process.poll() is not None or time.monotonic() > deadline:
                    process.kill()
                    raise RuntimeError(f"the run did not start:\n{process.communicate()[1]}")
            yield client
            client.call("stop")
        process.communicate(timeout=120)
    finally:
        if process.poll() is None:
            process.terminate()
            process.communicate()


def window(client: Any, rate: float, seconds: float) -> Window:
    """Window of `seconds` with `rate` commands a second (0: none). The answer of every command is read."""
    import zmq

    from rtctl.daemon.protocol import decode_reply, encode_request

    first = int(client.call("status")["ticks"])
    socket: zmq.Socket = zmq.Context.instance().socket(zmq.DEALER)
    socket.linger = 0
    socket.connect(client.endpoint)
    sent = answered = refused = 0
    began = time.monotonic()
    while (now := time.monotonic() - began) < seconds:
        while sent < now * rate:
            socket.send(encode_request(sent, "setpoint", {"value": 0.0}))  # present position
            sent += 1
        left = (sent + 1) / rate - (time.monotonic() - began) if rate else seconds - now
        ready = socket.poll(int(max(0, min(left, seconds - now)) * 1000))
        while ready and socket.poll(0):
            answered += 1
            refused += bool(decode_reply(socket.recv()).code)
    while answered < sent and socket.poll(2000):
        answered += 1
        refused += bool(decode_reply(socket.recv()).code)
    socket.close()
    return Window(sent, answered, refused, first, int(client.call("status")["ticks"]))


def measure(machine: str, rate: float, seconds: float, length: float, folder: Path) -> dict[str, Any]:
    """Results of all windows: `seconds` of commands in windows of `length` s."""
    from rtctl.trace.bundle import load_bundle

    pairs = max(1, round(seconds / length))
    windows: dict[str, list[Window]] = {"with": [], "without": []}
    with running(machine, folder / "run") as client:
        client.call("ping")
        for number in range(pairs):
            for which in ("with", "without") if number % 2 else ("without", "with"):
                windows[which].append(window(client, rate if which == "with" else 0.0, length))
        state = client.call("status")
    columns = load_bundle(folder / "run").columns
    edge = round(EDGE * state["rate_hz"])
    tick, lateness = columns["tick"], columns["lateness"]
    late = {
        which: [lateness[(tick >= w.first + edge) & (tick < w.last - edge)] for w in some]
        for which, some in windows.items()
    }
    each = {which: [percentiles(lateness) for lateness in some] for which, some in late.items()}
    told = windows["with"]
    return {
        "machine": machine,
        "rate_hz": state["rate_hz"],
        "ratio": {
            name: round(statistics.median(a[name] / b[name] for a, b in zip(*each.values(), strict=True)), 3)
            for name in SHARES
        },
        "with_us": percentiles(np.concatenate(late["with"])),
        "without_us": percentiles(np.concatenate(late["without"])),
        "windows": {which: [one["p99"] for one in some] for which, some in each.items()},
        "commands": sum(w.commands for w in told),
        "answered": sum(w.answered for w in told),
        "refused": sum(w.refused for w in told),
        "commands_per_s": round(sum(w.commands for w in told) / (pairs * length), 1),
        "seconds_with": round(pairs * length, 1),
        "ticks": state["ticks"],
        "missed": state["missed"],
        "rows": state["rows"],
        "trip": state["trip"],
        "lacks": state["lacks"],
    }


def percentiles(lateness: np.ndarray) -> dict[str, float]:
    """Percentiles in us of lateness in s."""
    return {name: round(float(np.quantile(lateness, share)) * 1e6, 3) for name, share in SHARES.items()}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--machine", choices=("ldu", "ivu"), default="ldu")
    parser.add_argument("--seconds", type=float, default=60.0, help="duration with commands, and without, s")
    parser.add_argument("--window", type=float, default=2.5, help="length of a window, s")
    parser.add_argument("--rate", type=float, default=1000.0, help="commands a second")
    given = parser.parse_args()
    if len(os.sched_getaffinity(0)) < 2:
        reason = "one CPU only: the loop needs one of its own"
        print(json.dumps({"skipped": reason}) if given.json else f"skipped: {reason}")
        return 3
    folder = Path(tempfile.mkdtemp(prefix="rtc-", dir="/tmp"))
    try:
        result = measure(given.machine, given.rate, given.seconds, given.window, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    if given.json:
        print(json.dumps(result))
        return 0
    for key, title in (("with_us", "with commands, us"), ("without_us", "without commands, us"), ("ratio", "ratio")):
        print(f"{title:20}" + "  ".join(f"{name} {result[key][name]:8.2f}" for name in SHARES))
    print(f"{result['commands']} commands, {result['commands_per_s']:g} a second, {result['answered']} answered, "
          f"{result['refused']} refused; missed {result['missed']} of {result['ticks']} ticks")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
