"""Cost of the scope's server at 10 kHz: share of a core, frames that reach a viewer, lost rows.

    python benchmarks/scope.py [--json] [--seconds S] [--viewers N] [--live]

A separate process sends rows of the linear drive at 10 kHz to the real server over the real socket; with --live the
rows come from `rtctl run ldu` in real time. Each viewer reads every frame at once, as a fast browser does. Case `idle`
is a server without viewers. The share is CPU time of the server's process (user and system) over wall time, after its
start.
"""

import argparse
import asyncio
import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import zmq

from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find
from rtctl.daemon.client import Client
from rtctl.daemon.rows import RowsOut
from rtctl.daemon.server import CommandServer, default_endpoint
from rtctl.loop import generate
from rtctl.machines import CONFIGS, build

RATE = 10_000.0
VIEWS: dict[str, dict[str, Any]] = {
    "roll, 5 s": {"window": 5.0},
    "roll, 20 s": {"window": 20.0},
    "trigger, 50 ms": {"window": 0.05, "trigger": {"mode": "normal", "signal": "u", "level": 0.0}},
    "spectrum, 5 s": {"kind": "spectrum", "window": 5.0},
    "xy, 5 s": {"kind": "xy", "x": "position", "window": 5.0},
}
SIGNALS = ["ref", "position", "position_error", "u"]
NAME = "scopebench"


class Daemon:
    """Substitute for a daemon that answers the requests of the scope."""

    def __init__(self, config: Any):
        self.config, self.machine = config, build(config)

    def handle(self, op: str, args: Any) -> dict[str, Any]:
        if op == "status":
            return {"name": NAME, "machine": "ldu", "pid": os.getpid(), "rate_hz": RATE, "state": "running"}
        if op == "signals":
            columns = generate.generate(self.machine, "shm").columns
            return {"signals": [{"name": c.name, "unit": c.unit, "help": c.help} for c in columns]}
        return {"value": getattr(self.config, args.path).model_dump(mode="json")}


def stream() -> None:
    """Send rows at 10 kHz in a hundred messages a second until the process ends."""
    daemon = Daemon(load_settings(find("ldu"), CONFIGS["ldu"], [f"name={NAME}"]))
    row = generate.generate(daemon.machine, "shm").row
    context = zmq.Context()
    server = CommandServer(default_endpoint(NAME, "command"), daemon, context)
    out = RowsOut(default_endpoint(NAME, "rows"), NAME, row, context)
    block = round(RATE / 100)
    rows = np.zeros(block, row)
    noise = np.random.default_rng(1)
    start, k = time.monotonic(), 0
    while True:
        n = np.arange(k, k + block)
        rows["tick"], rows["t"] = n, n / RATE
        rows["u"] = np.sin(2 * np.pi * 20.0 * n / RATE) + 0.01 * noise.standard_normal(block)
        rows["position"] = rows["ref"] = 1e-3 * np.sin(2 * np.pi * 2.0 * n / RATE)
        rows["lateness"] = 1e-5 * noise.random(block)
        out.publish(rows)
        k += block
        while (left := start + k / RATE - time.monotonic()) > 0:
            if server.socket.poll(max(1, int(left * 1000))):
                server.process()


@contextlib.contextmanager
def process(*command: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as run:
        try:
            yield run
        finally:
            run.terminate()


def cpu_s(pid: int) -> float:
    """CPU time of a process in s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def look(url: str, view: dict[str, Any], seconds: float, pid: int, viewers: int) -> dict[str, Any]:
    """Take frames for some seconds; with no viewers, only wait."""
    told: dict[str, Any] = {}
    frames = size = 0
    started = asyncio.Event()

    async def viewer(session: aiohttp.ClientSession, first: bool) -> None:
        nonlocal frames, size
        origin = url.partition("/?")[0]
        async with session.ws_connect(origin + "/stream", origin=origin, max_msg_size=0) as socket:
            await socket.send_json({"op": "view", "view": {"signals": SIGNALS, "columns": 1000, **view}})
            async for message in socket:
                if message.type is aiohttp.WSMsgType.BINARY:
                    await socket.send_json({"op": "drawn"})
                    if first and started.is_set():
                        frames, size = frames + 1, size + len(message.data)
                elif message.type is aiohttp.WSMsgType.TEXT and first:
                    found = json.loads(message.data)
                    if found["kind"] == "status":
                        told.update(found)

    async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as session:
        await (await session.get(url)).read()
        tasks = [asyncio.create_task(viewer(session, n == 0)) for n in range(viewers)]
        await asyncio.sleep(1.5)
        started.set()
        before, begin = cpu_s(pid), time.monotonic()
        dropped, lost = told.get("dropped", 0), told.get("lost", 0)
        await asyncio.sleep(seconds)
        wall = time.monotonic() - begin
        share = (cpu_s(pid) - before) / wall
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    return {
        "core_share": round(share, 4),
        "frames_per_s": round(frames / wall, 1),
        "kB_per_s": round(size / wall / 1000, 1),
        "dropped": told.get("dropped", 0) - dropped,
        "rows_lost": told.get("lost", 0) - lost,
    }


def source(live: bool, folder: Path) -> tuple[str, ...]:
    if not live:
        return (sys.executable, __file__, "--stream")
    return (
        sys.executable, "-m", "rtctl.cli.main", "run", "ldu", "--mode", "real", "--link", "shm", "--no-arm",
        "--no-plot",        "--set", f"name={NAME}", "--set", "safety.missed_ticks=0", "--out", str(folder / "bundle"),
    )  # fmt: skip


def measure(seconds: float, viewers: int, live: bool) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="rt-", dir="/tmp") as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        with process(*source(live, Path(folder))):
            with Client(default_endpoint(NAME, "command"), timeout=120.0) as client:
                client.call("status")
            with process(sys.executable, "-u", "-m", "rtctl.cli.main", "scope", NAME, "--port", "0") as scope:
                assert scope.stdout is not None
                found = re.search(r"http://\S+", scope.stdout.readline())
                assert found is not None, "the scope did not start"
                cases = {"idle": asyncio.run(look(found[0], {}, seconds, scope.pid, 0))}
                for name, view in VIEWS.items():
                    cases[name] = asyncio.run(look(found[0], view, seconds, scope.pid, viewers))
    worst = max(case["core_share"] for case in cases.values())
    about = {"rate_hz": RATE, "viewers": viewers, "seconds": seconds, "live": live}
    return {**about, "worst_core_share": worst, "cases": cases}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--viewers", type=int, default=1)
    parser.add_argument("--live", action="store_true", help="rows of `rtctl run ldu` in real time")
    parser.add_argument("--stream", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.stream:
        stream()
    found = measure(options.seconds, options.viewers, options.live)
    if options.json:
        print(json.dumps(found))
        return
    print(f"{'view':16} {'share of a core':>15} {'frames/s':>9} {'kB/s':>8} {'dropped':>8} {'rows lost':>10}")
    for name, case in found["cases"].items():
        counts = f"{case['frames_per_s']:9.1f} {case['kB_per_s']:8.1f} {case['dropped']:8} {case['rows_lost']:10}"
        print(f"{name:16} {case['core_share']:15.1%} {counts}")


if __name__ == "__main__":
    main()
