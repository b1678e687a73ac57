"""Time from `rtctl run` to the first tick on the wall clock.

    python benchmarks/startup.py [--json] [--machine ivu|ldu] [--repeats N] [--cold]

CLOCK_MONOTONIC is read before the start of the process. The loop writes the time of its first tick by this clock into
the machine's shared segment (`first_ns` of its status), and this program reads it there. The time includes Python's
imports, the config, compiled code from the cache, start of the plant and loop processes, and the handshake of the link.
`--cold` also starts with an empty RTCTL_CACHE_DIR, which includes compilation of tick and plant. It then starts over
the other link twice: with an empty cache, and with the compiled steps of the first run.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from lateness import CONFIGS, rtctl_command

from rtctl.daemon.shared_memory import segment_path
from rtctl.loop.records import STATUS

LIMIT = 300.0  # s


def start(machine: str, link: str, folder: Path, cache: Path | None) -> float:
    """Time in s to the first tick of a short run. Raises RuntimeError without a tick."""
    name = f"start-{os.getpid()}"
    segment = segment_path(name)
    command = (
        *rtctl_command(), "run", str(CONFIGS / f"{machine}.yaml"), "--mode", "real", "--link", link, "--for", "0.5s",
        "--set", f"name={name}", "--json", "--no-plot", "--out", str(folder / f"bundle-{time.monotonic_ns()}"),
    )  # fmt: skip
    environment = {**os.environ, **({"RTCTL_CACHE_DIR": str(cache)} if cache is not None else {})}
    before = time.monotonic_ns()
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    first = 0
    while not first and process.poll() is None and time.monotonic_ns() - before < LIMIT * 1e9:
        time.sleep(0.005)
        first = first_tick(segment)
    if not first:
        process.terminate()
    error = process.communicate()[1]
    if not first:
        raise RuntimeError(f"no tick came:\n{error}")
    return (first - before) * 1e-9


def first_tick(path: Path) -> int:
    """Clock at the first tick in ns; 0 before it."""
    try:
        with path.open("rb") as file:
            data = file.read(STATUS.itemsize)  # the status is the first record of the segment
    except FileNotFoundError:
        return 0
    if len(data) < STATUS.itemsize:
        return 0
    status = np.frombuffer(data, STATUS)[0]
    return int(status["first_ns"]) if status["ready"] else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--machine", choices=("ivu", "ldu"), default="ivu")
    parser.add_argument("--link", choices=("zmq", "shm"), default="zmq")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--cold", action="store_true", help="also measure a start with an empty cache")
    given = parser.parse_args()
    result: dict[str, Any] = {"machine": given.machine, "link": given.link}
    with tempfile.TemporaryDirectory(prefix="rtb-", dir="/tmp") as folder:
        start(given.machine, given.link, Path(folder), None)  # compiles where needed
        warm = [start(given.machine, given.link, Path(folder), None) for _ in range(given.repeats)]
        result["warm_s"] = round(statistics.median(warm), 3)
        result["warm_range_s"] = [round(min(warm), 3), round(max(warm), 3)]
        if given.cold:
            cache, empty = Path(folder) / "cache", Path(folder) / "empty"
            result["cold_s"] = round(start(given.machine, given.link, Path(folder), cache), 2)
            other = "shm" if given.link == "zmq" else "zmq"  # another tick with nearly the same steps
            alone, after = (start(given.machine, other, Path(folder), each) for each in (empty, cache))
            result["another_cold_s"], result["another_after_first_s"] = round(alone, 2), round(after, 2)
            result["another_ratio"] = round(after / alone, 2)
    if given.json:
        print(json.dumps(result))
    else:
        print(f"{given.machine} over {given.link}: {result['warm_s']:.2f} s from the command to the first tick")
        if given.cold:
            print(f"with an empty cache {result['cold_s']:.1f} s")
            alone, after = result["another_cold_s"], result["another_after_first_s"]
            print(f"over the other link {alone:.1f} s, with the compiled steps of the first run {after:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
