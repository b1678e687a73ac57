"""Lateness of the rtctl loop, against cyclictest on the same CPU with the same period and priority.

    python benchmarks/lateness.py [--json] [--machine ldu|ivu] [--rate HZ] [--seconds S] [--rounds N]

A round is one window of each, in sequence, so that other load affects all equally:

    ours    rtctl run MACHINE --mode real --link shm: loop on the last CPU, its plant on another
    load    cyclictest, while the same plant runs on that other CPU
    bare    cyclictest alone

Both sleep with clock_nanosleep(TIMER_ABSTIME) on CLOCK_MONOTONIC and measure the time from the due wake-up to the
reading of the clock. The ratio of a round is rtctl over cyclictest; the result is the median over the rounds.
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
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rtctl.doctor.cyclictest import LONGEST_NS, SHARES, counted  # noqa: F401, peers.py imports `counted` from here
from rtctl.doctor.cyclictest import missing as why_no_cyclictest
from rtctl.doctor.cyclictest import run as run_cyclictest

CONFIGS = Path(__file__).parents[1] / "configs"
RATES = {"ivu": 500.0, "ldu": 10_000.0}
PRIORITY = 80
TITLES = {
    "lateness_us": "ours",
    "cyclictest_us": "cyclictest, plant beside it",
    "bare_cyclictest_us": "cyclictest alone",
    "ratio_to_cyclictest": "ratio, plant beside it",
    "ratio_to_bare_cyclictest": "ratio, alone",
    "tick_us": "tick",
}


def rtctl_command() -> tuple[str, ...]:
    """The `rtctl` beside this Python, or the one on the path."""
    beside = Path(sys.executable).parent / "rtctl"
    return (str(beside),) if beside.exists() else ("rtctl",)


def why_no_realtime() -> str | None:
    """Reason why the rtctl loop cannot be measured here, as a sentence; None where it can."""
    if len(os.sched_getaffinity(0)) < 2:
        return "one CPU only: the plant needs another than the loop's"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    except OSError:
        return f"this account may not use SCHED_FIFO at priority {PRIORITY}; run as root or allow rtprio"
    return None


def ours(machine: str, rate: float, link: str, seconds: float, folder: Path) -> dict[str, Any]:
    """Window of the rtctl loop; returns the JSON of the run."""
    out = folder / "bundle"
    shutil.rmtree(out, ignore_errors=True)
    command = (
        *rtctl_command(), "run", str(CONFIGS / f"{machine}.yaml"), "--mode", "real", "--link", link,
        "--for", f"{seconds}s", "--set", f"name=bench-{os.getpid()}", "--set", f"loop.rate={rate}",
        "--set", f"loop.priority={PRIORITY}", "--set", "safety.missed_ticks=0", "--set", "safety.link_timeout=1",
        "--json", "--no-plot", "--out", str(out),
    )  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout.strip():
        raise RuntimeError(f"rtctl run failed:\n{done.stderr}")
    return json.loads(done.stdout)


@contextlib.contextmanager
def plant(machine: str, rate: float, folder: Path) -> Iterator[None]:
    """Emulator alone on the first CPU, its CPU beside the rtctl loop."""
    command = (
        *rtctl_command(), "plant", str(CONFIGS / f"{machine}.yaml"), "--endpoint", f"ipc://{folder}/plant",
        "--mode", "real", "--set", f"name=bench-{os.getpid()}", "--set", f"loop.rate={rate}",
    )  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    os.sched_setaffinity(process.pid, {min(os.sched_getaffinity(0))})  # before the emulator starts threads
    assert process.stdout is not None and process.stderr is not None
    try:
        if not process.stdout.readline():  # the emulator prints a line when compiled and listening
            raise RuntimeError(f"rtctl plant ended:\n{process.stderr.read()}")
        yield
    finally:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def cyclictest(rate: float, seconds: float, folder: Path) -> dict[str, float]:
    """Window of cyclictest on the last CPU: percentiles in us, from a histogram with a bucket per nanosecond."""
    return run_cyclictest(rate, seconds, max(os.sched_getaffinity(0)), PRIORITY, folder).percentiles()


def percentiles(histogram: dict[str, int], cycles: int) -> dict[str, float]:
    """Percentiles in us, linear within their bucket; values beyond all buckets count as LONGEST_NS."""
    told = counted(histogram, cycles).percentiles()
    return {name: told[name] for name in SHARES}


def median_of(values: list[dict[str, float]]) -> dict[str, float]:
    """Median of each percentile over the windows."""
    return {name: round(statistics.median(v[name] for v in values), 3) for name in values[0]}


def ratio(a: list[dict[str, float]], b: list[dict[str, float]]) -> dict[str, float]:
    """Median over the rounds of the ratio a / b."""
    return {n: round(statistics.median(x[n] / y[n] for x, y in zip(a, b, strict=True)), 3) for n in SHARES}


def measure(machine: str, rate: float, seconds: float, rounds: int, folder: Path) -> dict[str, Any]:
    """Results of all windows."""
    ours(machine, rate, "shm", 0.5, folder)  # compile where needed, outside the windows
    ours(machine, rate, "zmq", 0.5, folder)
    ours_at, load_at, bare_at, ticks, zmq, runs = [], [], [], [], [], []
    for number in range(rounds):
        windows = ["ours", "load", "bare"]
        for window in windows if number % 2 == 0 else reversed(windows):
            if window == "ours":
                runs.append(ours(machine, rate, "shm", seconds, folder))
                ours_at.append(runs[-1]["lateness_us"])
                ticks.append(runs[-1]["tick_us"])
            elif window == "load":
                with plant(machine, rate, folder):
                    load_at.append(cyclictest(rate, seconds, folder))
            else:
                bare_at.append(cyclictest(rate, seconds, folder))
        zmq.append(ours(machine, rate, "zmq", seconds, folder))
    return {
        "machine": machine,
        "rate_hz": rate,
        "ratio_to_cyclictest": ratio(ours_at, load_at),
        "ratio_to_bare_cyclictest": ratio(ours_at, bare_at),
        "lateness_us": median_of(ours_at),
        "cyclictest_us": median_of(load_at),
        "bare_cyclictest_us": median_of(bare_at),
        "tick_us": median_of(ticks),
        "exchange_us": median_of([r["exchange_us"] for r in runs]),
        "missed": sum(r["missed"] for r in runs),
        "missed_inside": sum(r["overruns"] for r in runs),
        "ticks": sum(r["ticks"] for r in runs),
        "zmq": {
            "sample_age_us": {
                n: v for n, v in median_of([r["sample_age_us"] for r in zmq]).items() if n in ("p50", "p99")
            },
            "exchange_us": median_of([r["exchange_us"] for r in zmq]),
            "lateness_us": median_of([r["lateness_us"] for r in zmq]),
            "missed": sum(r["missed"] for r in zmq),
            "missed_inside": sum(r["overruns"] for r in zmq),
            "ticks": sum(r["ticks"] for r in zmq),
        },
        "rounds": rounds,
        "seconds": seconds,
        "windows": {"ours": ours_at, "load": load_at, "bare": bare_at},
        "lacks": runs[-1]["lacks"],
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--machine", choices=sorted(RATES), default="ldu")
    parser.add_argument("--rate", type=float, help="rate in Hz; default: that of the shipped config")
    parser.add_argument("--seconds", type=float, default=5.0, help="length of a window, whole seconds for cyclictest")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    reason = why_no_cyclictest() or why_no_realtime()
    if reason is not None:
        print(json.dumps({"skipped": reason}) if given.json else f"skipped: {reason}")
        return 3
    rate = given.rate or RATES[given.machine]
    with tempfile.TemporaryDirectory(prefix="rtb-", dir="/tmp") as folder:
        result = measure(given.machine, rate, given.seconds, given.rounds, Path(folder))
    if given.json:
        print(json.dumps(result))
        return 0
    for key, title in TITLES.items():
        print(f"{title:28s}" + "  ".join(f"{n} {result[key][n]:8.2f}" for n in SHARES))
    print(f"missed {result['missed']} of {result['ticks']} ticks, {result['missed_inside']} of them by the tick itself")
    z = result["zmq"]
    print(f"zmq: sample age p50 {z['sample_age_us']['p50']} p99 {z['sample_age_us']['p99']} us, missed {z['missed']}, "
          f"{z['missed_inside']} by the tick itself")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
