"""Monitoring of a running machine (`rtctl watch`): false alarms, detection rate, and cost.

    python benchmarks/watch.py [--json] [--machine ivu|ldu] [--days N] [--trials N] [--learn S] [--rounds N]

false_alarms_per_day   simulated days of eight hours on virtual time, with independent random moves and a band learned
                       from moves before
noticed_share          concealed effects of usual size (drawn as by `rtctl plant --conceal SEED`, seeds from 0) that
                       begin in mid-run: the share noticed within 30 s of motion; median_delay_s is the motion until
                       the alarm
core_share_500hz       CPU time of reading rows, testing and reporting over the time of the rows, in pieces of 0.25 s
core_share_10khz       as in the live watch
lateness_ratio         p99 lateness of a loop in real mode with a watch and a diagnosis over that without, median of
                       rounds; null where it is not measured (--rounds 0)
"""

import argparse
import contextlib
import copy
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

from rtctl import api
from rtctl.diagnose.conceal import conceal
from rtctl.watch.band import Band
from rtctl.watch.monitor import Monitor
from rtctl.watch.rehearsal import Moves, Shift, usual
from rtctl.watch.report import report

DAY = 8 * 3600.0  # s
PIECE = 300.0  # s of a day held in memory at a time
HEALTHY = 20.0  # s before the start of an effect
WITHIN = 30.0  # s of motion until an alarm counts as missed
SHOWN = 1.0  # counts rms: least change of a sensor by a visible effect
WATCHED = 90.0  # s, longest trial
TURN = 0.25  # s of rows at a time, as in the live watch
SEED = 20250614  # seed of learning and days; trials add their number


def learned(config: Any, moves: Moves, seed: int, seconds: float) -> tuple[Shift, np.random.Generator, Monitor]:
    """Shift, random generator and monitor with a learned band."""
    shift, rng = Shift(config), np.random.default_rng([SEED, seed])
    monitor = Monitor(shift.case, seconds=seconds)
    while monitor.band is None:
        rows = shift.play(moves, rng, 60.0)
        if rows["trip"].any():
            raise SystemExit(f"{config.name} tripped while it was learned from: the moves are too much for it")
        monitor.feed(rows)
    return shift, rng, monitor


def days(config: Any, moves: Moves, numbers: range, seconds: float, say: Any) -> list[dict[str, Any]]:
    """Alarms and number of tested windows of each simulated day."""
    out = []
    for day in numbers:
        shift, rng, monitor = learned(config, moves, day, seconds)
        alarms, judged = [], monitor.judged
        for _ in range(round(DAY / PIECE)):
            alarm = monitor.feed(shift.play(moves, rng, PIECE))
            if alarm is not None:
                alarms.append(f"{alarm.measure} of {alarm.sensor}")
        out.append({"day": day, "alarms": alarms, "windows": monitor.judged - judged})
        say(json.dumps(out[-1]))
    return out


def trial(config: Any, moves: Moves, band: Band, seed: int) -> dict[str, Any]:
    """Trial of an effect that begins in mid-run: the effect and the time of its alarm."""
    hidden, entry = conceal(config, seed)
    shift, rng = Shift(config), np.random.default_rng([SEED, 1000, seed])
    monitor = Monitor(shift.case, band=band)
    early = monitor.feed(shift.play(moves, rng, HEALTHY))
    other = shift.become(hidden)
    shown = moved(shift, other.become(hidden), moves, copy.deepcopy(rng))
    judged, delay, measure, tripped = monitor.judged, None, "", False
    begin = other.tick / other.machine.rate
    while monitor.judged - judged < WATCHED and not tripped:
        rows = other.play(moves, rng, 2.0)
        tripped = bool(rows["trip"].any())
        alarm = monitor.feed(rows)
        if alarm is not None:
            delay, measure = float(monitor.judged - judged), f"{alarm.measure} of {alarm.sensor}"
            break
        if other.tick / other.machine.rate - begin > 4 * WATCHED:
            break
    return {
        "seed": seed, "term": entry["term"], "node": entry["node"], "early": early is not None, "delay_s": delay,
        "shown_counts": shown, "measure": measure, "tripped": tripped,
        "noticed": delay is not None and delay <= WITHIN and early is None,
    }  # fmt: skip


def moved(healthy: Shift, hidden: Shift, moves: Moves, rng: np.random.Generator) -> float:
    """Largest rms change of a sensor by an effect in WITHIN s of the same setpoints, counts."""
    before, after = healthy.play(moves, copy.deepcopy(rng), WITHIN), hidden.play(moves, rng, WITHIN)
    columns = [name for name in before.dtype.names if name.endswith("_counts")]
    return max(float(np.sqrt(np.mean((before[name].astype(float) - after[name]) ** 2))) for name in columns)


def share(config: Any, moves: Moves, seconds: float) -> float:
    """CPU time of a monitor over the time of its rows, run as in the live watch."""
    shift, rng, monitor = learned(config, moves, 0, 120.0)
    rows = shift.play(moves, rng, seconds)
    rows = rows[rows["tick"] >= 0]
    piece = round(TURN * shift.machine.rate)
    begun = time.process_time()
    for k, at in enumerate(range(0, len(rows), piece)):
        monitor.feed(rows[at : at + piece].copy())
        if k % round(1.0 / TURN) == 0:
            report(monitor, [], None)
    return (time.process_time() - begun) / (len(rows) / shift.machine.rate)


def lateness(rounds: int, seconds: float) -> float:
    """Ratio of p99 lateness of a loop with a watch and a diagnosis to that without, median of rounds."""
    rtctl = str(Path(sys.executable).parent / "rtctl")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        bundle = Path(folder) / "bundle"
        subprocess.run([rtctl, "run", "ivu", "--mode", "fused", "--reference", "steps", "--for", "13s", "--no-plot",
                        "--out", str(bundle)], check=True, capture_output=True)  # fmt: skip
        for number in range(rounds):
            found = [_round(rtctl, Path(folder) / f"{number}-{beside}", seconds, bundle if beside else None)
                     for beside in (False, True)]  # fmt: skip
            ratios.append(found[1] / found[0])
    return statistics.median(ratios)


def _round(rtctl: str, out: Path, seconds: float, bundle: Path | None) -> float:
    name = f"bench-watch-{os.getpid()}"
    run = subprocess.Popen(
        [rtctl, "run", "ivu", "--mode", "real", "--link", "shm", "--for", f"{seconds}s", "--reference", "steps",
         "--set", f"name={name}", "--json", "--no-plot", "--out", str(out)],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    others = []
    if bundle is not None:
        from rtctl.daemon.client import Client
        from rtctl.daemon.server import default_endpoint
        from rtctl.watch.background import lowest

        with Client(default_endpoint(name, "command")) as client, contextlib.suppress(Exception):
            while run.poll() is None:
                with contextlib.suppress(Exception):
                    client.call("status")
                    break
                time.sleep(0.1)
        others.append(subprocess.Popen([rtctl, "watch", name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        cpu = max(os.sched_getaffinity(0))
        others.append(subprocess.Popen(
            [rtctl, "diagnose", str(bundle), "--out", str(out) + "-diagnosis"], stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, preexec_fn=lambda: lowest(cpu),
        ))  # fmt: skip
    said, _ = run.communicate()
    for other in others:
        other.terminate()
        other.wait()
    return float(json.loads(said)["lateness_us"]["p99"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--machine", default="ivu", choices=("ivu", "ldu", "axis"))
    parser.add_argument("--days", type=int, default=20, help="simulated days of eight hours")
    parser.add_argument("--first", type=int, default=0, help="number of the first day and trial")
    parser.add_argument("--trials", type=int, default=100, help="effects that begin in mid-run")
    parser.add_argument("--learn", type=float, default=600.0, help="motion from which a band is learned, s")
    parser.add_argument("--rounds", type=int, default=3, help="rounds of the lateness, 20 s each; 0: not measured")
    parser.add_argument("--details", type=Path, help="file for every day and trial, JSON")
    given = parser.parse_args()
    say = (lambda line: print(line, file=sys.stderr, flush=True)) if not given.json else (lambda line: None)
    config = api.load_config(given.machine)
    moves = usual(config)
    per_day = days(config, moves, range(given.first, given.first + given.days), given.learn, say)
    band = learned(config, moves, 10_000, given.learn)[2].band
    assert band is not None
    tried = []
    for seed in range(given.first, given.first + given.trials):
        tried.append(trial(config, moves, band, seed))
        say(json.dumps(tried[-1]))
    delays = [t["delay_s"] for t in tried if t["noticed"]]
    seen = [t for t in tried if t["shown_counts"] >= SHOWN]
    slow = api.load_config("ivu", {"loop.rate": 500.0})
    fast = api.load_config("ldu")
    out = {
        "false_alarms_per_day": sum(len(d["alarms"]) for d in per_day) / len(per_day) if per_day else None,
        "noticed_of_shown": statistics.fmean(t["noticed"] for t in seen) if seen else None,
        "noticed_share": sum(t["noticed"] for t in tried) / len(tried) if tried else None,
        "median_delay_s": statistics.median(delays) if delays else None,
        "core_share_500hz": share(slow, usual(slow), 120.0),
        "core_share_10khz": share(fast, usual(fast)._replace(jumps=0.0), 30.0),  # a 20 mm jump trips the machine
        "lateness_ratio": lateness(given.rounds, 20.0) if given.rounds else None,
        "machine": given.machine, "days": len(per_day), "trials": len(tried),
    }  # fmt: skip
    if given.details is not None:
        given.details.write_text(json.dumps({**out, "per_day": per_day, "tried": tried}, indent=1) + "\n", "utf-8")
    if given.json:
        print(json.dumps(out))
    else:
        for key, value in out.items():
            print(f"{key:24}{value}")


if __name__ == "__main__":
    main()
