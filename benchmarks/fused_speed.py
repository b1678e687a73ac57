"""Speed of a fused run, relative to real time and to hand-written C.

    python benchmarks/fused_speed.py [--json] [--seconds S] [--windows N]
    python benchmarks/fused_speed.py --described belt     a described machine, which has no C program

Each window is a run of the shipped config with the shipped reference from rest, rtctl and C alternately, on one CPU.
"""

import argparse
import json
import math
import os
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from twins import CONFIGS, Ours, Reference, machine_of

from rtctl import machines
from rtctl.cli.common import load_config, with_loop

VIRTUAL = {"ivu": 12.0, "ldu": 3.5}  # s, length of the reference
SHORTEST = 0.1  # s of wall time in a window; in shorter windows clock and call overhead matter
WATCHED = {"ivu": "truth_capstan", "ldu": "truth_x"}
TARGETS = {"ivu": 1000.0, "ldu": 100.0}
FAST = ("-O3", "-march=native", "-ffp-contract=off")


def timed(twin: Any, ticks: int, repeats: int) -> float:
    """Wall time in s of `repeats` runs from rest, without the reset to rest."""
    total = 0
    for _ in range(repeats):
        twin.reset()
        before = time.perf_counter_ns()
        twin.run(ticks)
        total += time.perf_counter_ns() - before
    return total * 1e-9


def measure(kind: str, seconds: float | None, windows: int, folder: Path) -> dict[str, Any]:
    """Results of one machine: speed, ratio, and agreement of rtctl and C."""
    machine = machine_of(kind)
    ticks = round((seconds or VIRTUAL[kind]) * machine.rate)
    ours = Ours(machine)
    twins = {
        "ours": ours,
        "c": Reference(machine, ours.made.row, len(ours.rows), folder),
        "fast": Reference(machine, ours.made.row, len(ours.rows), folder, FAST),
    }
    once = {name: timed(twin, ticks, 1) for name, twin in twins.items()}
    agreement = agree(kind, ours, twins["c"], min(ticks, len(ours.rows)))
    once = {name: timed(twin, ticks, 1) for name, twin in twins.items()}
    repeats = max(1, math.ceil(SHORTEST / min(once.values())))
    took: dict[str, list[float]] = {name: [] for name in twins}
    for window in range(windows):
        order = list(twins) if window % 2 == 0 else list(reversed(twins))
        for name in order:
            took[name].append(timed(twins[name], ticks, repeats))
    ran = ticks * repeats
    ratios = [a / b for a, b in zip(took["ours"], took["c"], strict=True)]
    per_tick = {name: statistics.median(values) / ran * 1e6 for name, values in took.items()}
    return {
        "x_realtime": round(1e6 / (per_tick["ours"] * machine.rate), 1),
        "ratio_to_c": round(statistics.median(ratios), 3),
        "ratio_range": [round(min(ratios), 3), round(max(ratios), 3)],
        "ratio_to_c_o3_native": round(
            statistics.median(a / b for a, b in zip(took["ours"], took["fast"], strict=True)), 3
        ),
        **agreement,
        "us_per_tick": round(per_tick["ours"], 4),
        "us_per_tick_c": round(per_tick["c"], 4),
        "substeps": machine.substeps,
        "ticks": ran,
        "windows": windows,
        "target": {"x_realtime": TARGETS[kind], "ratio_to_c": 1.5},
    }


def described(name: str, windows: int) -> dict[str, Any]:
    """Results of a described machine: only its speed."""
    config = load_config(str(CONFIGS / "machines" / f"{name}.yaml"), [])
    machine = machines.build(with_loop(config, "fused", None))
    ours = Ours(machine)
    ticks = round((config.reference.repeat or 4.0) * machine.rate)
    repeats = max(1, math.ceil(SHORTEST / timed(ours, ticks, 1)))
    took = [timed(ours, ticks, repeats) / (ticks * repeats) for _ in range(windows)]
    return {
        "x_realtime": round(1.0 / (statistics.median(took) * machine.rate), 1),
        "x_realtime_best": round(1.0 / (min(took) * machine.rate), 1),
        "us_per_tick": round(statistics.median(took) * 1e6, 4),
        "substeps": machine.substeps,
        "ticks": ticks * repeats,
        "windows": windows,
        "ended_running": bool(ours.rows["state"][:ticks][-1] == 2),
        "target": {"x_realtime": 3000.0},
    }


def agree(kind: str, ours: Any, c: Any, ticks: int) -> dict[str, Any]:
    """Largest difference of both recordings, relative to the largest value of each column."""
    a, b = ours.rows[:ticks], c.rows[:ticks]
    worst, where = 0.0, None
    for name in a.dtype.names:
        scale = max(float(np.max(np.abs(b[name]))), 1e-300)
        difference = float(np.max(np.abs(a[name] - b[name]))) / scale
        if not difference <= worst:
            worst, where = difference, name
    final_a, final_b = float(a[WATCHED[kind]][-1]), float(b[WATCHED[kind]][-1])
    scale = max(float(np.max(np.abs(b[WATCHED[kind]]))), 1e-300)
    return {
        "agrees_to": abs(final_a - final_b) / scale,
        "agrees_to_all_columns": worst,
        "worst_column": where,
        "final": {"column": WATCHED[kind], "ours": final_a, "c": final_b},
        "identical": bool(np.array_equal(a.view(np.int64), b.view(np.int64))),
        "ended_running": bool(a["state"][-1] == 2),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--seconds", type=float, help="virtual time of a run, s; default: the whole reference")
    parser.add_argument("--windows", type=int, default=9, help="windows of rtctl and of C, alternately")
    parser.add_argument("--machine", choices=sorted(VIRTUAL), action="append", help="only this machine")
    parser.add_argument("--described", metavar="NAME", action="append", help="a described machine, such as belt")
    given = parser.parse_args()
    if given.described:
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
        found = {name: described(name, given.windows) for name in given.described}
        if given.json:
            print(json.dumps(found))
            return 0
        for name, r in found.items():
            print(
                f"{name}: {r['x_realtime']:.0f} x real time (best window {r['x_realtime_best']:.0f}), "
                f"{r['us_per_tick']:.3f} us a tick of {r['substeps']} substeps"
            )
        return 0
    if shutil.which("cc") is None:
        message = "no C compiler (cc) was found for the comparison; install gcc"
        print(json.dumps({"skipped": message}) if given.json else message)
        return 3
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    with tempfile.TemporaryDirectory() as folder:
        result = {k: measure(k, given.seconds, given.windows, Path(folder)) for k in given.machine or VIRTUAL}
    if given.json:
        print(json.dumps(result))
        return 0
    for kind, r in result.items():
        same = "same bits" if r["identical"] else f"agrees to {r['agrees_to_all_columns']:.1e}"
        print(
            f"{kind}: {r['x_realtime']:.0f} x real time, {r['ratio_to_c']:.2f} of the time of C "
            f"({r['ratio_range'][0]:.2f} to {r['ratio_range'][1]:.2f}), {r['us_per_tick']:.3f} us a tick "
            f"of {r['substeps']} substeps; {same}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
