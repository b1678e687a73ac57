"""Lateness and tick cost of the rtctl loop, against cyclictest and a HAL thread of LinuxCNC.

    python benchmarks/peers.py [--json] [--rate HZ] [--seconds S] [--rounds N] [--stress]

A round is one window of each, in sequence; the next round has the reverse order. All wake at the same rate on the last
CPU; an emulated LDU runs on the first CPU during all windows:

    ours         rtctl run ldu --mode real --link shm
    cyclictest   of rt-tests
    hal          hal/law.hal: two `pid` and a `lowpass` in a thread of rtapi_app
    law          the law of `hal` with steps of rtctl in a bare thread (hal/law.py): only its cost

--stress loads every CPU with a busy process during all windows, and rtctl also with four viewers and 200 clients.

The result is the median over the rounds of rtctl over the peer. A peer that is not installed is left out. Without any
peer the program reports this and ends with 3. It installs nothing.
"""

import argparse
import contextlib
import json
import os
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from hal import law, session
from lateness import (
    LONGEST_NS,
    PRIORITY,
    SHARES,
    cyclictest,
    median_of,
    ours,
    percentiles,
    plant,
    ratio,
    why_no_cyclictest,
    why_no_realtime,
)
from stress import asked, busy

MACHINE = "ldu"
TARGETS = {"lateness": 1.1, "law": 2.0}
PEERS = ("cyclictest", "hal")


def cost(counts: np.ndarray, counts_per_ns: float) -> dict[str, float]:
    """Cost of a tick in ns: percentiles, and the interquartile mean, as the counter may have coarse steps."""
    ns = np.sort(counts) / counts_per_ns
    middle = ns[len(ns) // 4 : len(ns) - len(ns) // 4]
    return {"middle": round(float(middle.mean()), 2), **{
        name: round(float(np.quantile(ns, share)), 2) for name, share in SHARES.items()
    }}  # fmt: skip


def hal_window(library: Path, rate: float, seconds: float, folder: Path, counts_per_ns: float) -> dict[str, Any]:
    """Window of HAL: lateness in us, cost of the law and of the whole thread in ns."""
    window = session.run(library, rate, seconds, folder)
    late = np.flatnonzero(window.wakeups[:LONGEST_NS])
    return {
        "lateness_us": percentiles({str(ns): int(window.wakeups[ns]) for ns in late}, int(window.wakeups.sum())),
        "law_ns": cost(window.times[:, :3].sum(axis=1), counts_per_ns),
        "thread_ns": cost(window.times[1:, 3], counts_per_ns),
        "ticks": len(window.times),
    }


def loaded(rate: float, seconds: float, folder: Path, stress: bool) -> dict[str, Any]:
    """Window of rtctl; under stress with viewers and clients."""
    with asked(f"bench-{os.getpid()}") if stress else contextlib.nullcontext():
        return ours(MACHINE, rate, "shm", seconds, folder)


def measure(
    rate: float, seconds: float, rounds: int, absent: dict[str, str], folder: Path, stress: bool = False
) -> dict[str, Any]:
    """Results of all windows; a peer that fails to run is added to `absent`."""
    ours(MACHINE, rate, "shm", 0.5, folder)  # compile where needed, outside the windows
    counts_per_ns = law.run(rate, 0.5, PRIORITY)[1]
    library = session.build(folder) if "hal" not in absent else folder
    done: dict[str, list[Any]] = {name: [] for name in ("ours", "law", *PEERS)}
    for number in range(rounds):
        beside = [name for name in ("cyclictest", "hal", "law") if name not in absent]
        if number % 2 == 0:
            done["ours"].append(loaded(rate, seconds, folder, stress))
        with plant(MACHINE, rate, folder):
            for name in beside if number % 2 == 0 else reversed(beside):
                try:
                    done[name].append(window_of(name, rate, seconds, folder, library, counts_per_ns))
                except session.NoPeerError as reason:
                    absent["hal"] = str(reason)
        if number % 2 == 1:
            done["ours"].append(loaded(rate, seconds, folder, stress))
    return result_of(done, absent, rate, seconds)


def window_of(name: str, rate: float, seconds: float, folder: Path, library: Path, counts_per_ns: float) -> Any:
    if name == "cyclictest":
        return cyclictest(rate, seconds, folder)
    if name == "hal":
        return hal_window(library, rate, seconds, folder, counts_per_ns)
    took, per_ns = law.run(rate, min(seconds, 1.0), PRIORITY)
    return cost(took, per_ns)


def result_of(done: dict[str, list[Any]], absent: dict[str, str], rate: float, seconds: float) -> dict[str, Any]:
    """Medians, ratios, and whether the targets are met."""
    runs, laws = done["ours"], done["law"]
    hal = done["hal"] if len(done["hal"]) == len(runs) else []
    mine = [r["lateness_us"] for r in runs]
    result: dict[str, Any] = {
        "rate_hz": rate, "seconds": seconds, "rounds": len(runs), "target": TARGETS, "absent": absent,
        "ours": {"lateness_us": median_of(mine), "tick_us": median_of([r["tick_us"] for r in runs]),
                 "law_ns": median_of(laws), "missed": sum(r["missed"] for r in runs),
                 "ticks": sum(r["ticks"] for r in runs)},
        "lateness_ratio": {}, "met": {},
    }  # fmt: skip
    theirs = {"cyclictest": done["cyclictest"], "hal": [w["lateness_us"] for w in hal]}
    for peer, windows in theirs.items():
        if windows:
            result[peer] = {"lateness_us": median_of(windows)}
            found = result["lateness_ratio"][peer] = ratio(mine, windows)
            result["met"][f"lateness_{peer}"] = all(v <= TARGETS["lateness"] for v in found.values())
    if hal:
        costs = [w["law_ns"] for w in hal]
        result["hal"] |= {"law_ns": median_of(costs), "thread_ns": median_of([w["thread_ns"] for w in hal]),
                          "ticks": sum(w["ticks"] for w in hal)}  # fmt: skip
        result["law_ratio"] = median_ratio([x["middle"] for x in laws], [x["middle"] for x in costs])
        result["tick_to_hal_law"] = median_ratio(
            [1000 * r["tick_us"]["p50"] for r in runs], [x["middle"] for x in costs]
        )
        result["met"]["law"] = result["law_ratio"] <= TARGETS["law"]
    result["windows"] = {"ours": mine, "law": laws, **theirs}
    return result


def median_ratio(a: list[float], b: list[float]) -> float:
    return round(statistics.median(x / y for x, y in zip(a, b, strict=True)), 3)


def report(result: dict[str, Any]) -> str:
    """Result as text."""
    lines = [f"{'lateness, us':34s}" + "".join(f"{n:>9s}" for n in SHARES)]
    for name in ("ours", *PEERS):
        if name in result:
            lines.append(f"  {name:32s}" + "".join(f"{result[name]['lateness_us'][n]:9.2f}" for n in SHARES))
    for peer, found in result["lateness_ratio"].items():
        lines.append(f"  {'rtctl over ' + peer:32s}" + "".join(f"{found[n]:9.2f}" for n in SHARES))
    lines.append(f"CPU of a tick, ns{'':17s}" + "".join(f"{n:>9s}" for n in ("middle", *SHARES)))
    rows = {"two pd and a low_pass, rtctl": result["ours"]["law_ns"]}
    if "hal" in result:
        rows["two pid and a lowpass, hal"] = result["hal"]["law_ns"]
        rows["hal's whole thread"] = result["hal"]["thread_ns"]
    for name, values in rows.items():
        lines.append(f"  {name:32s}" + "".join(f"{values[n]:9.1f}" for n in ("middle", *SHARES)))
    tick = result["ours"]["tick_us"]
    lines.append(f"  {'the whole tick of the LDU':32s}{'':9s}" + "".join(f"{1000 * tick[n]:9.1f}" for n in SHARES))
    if "hal" in result:
        alone, whole = result["law_ratio"], result["tick_to_hal_law"]
        lines.append(f"  law: {alone:.2f} times HAL's; the whole tick of the LDU: {whole:.1f} times HAL's law")
    lines += [f"{'met' if met else 'missed'}: {name}" for name, met in result["met"].items()]
    lines += [f"not compared with {peer}: {why}" for peer, why in result["absent"].items()]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--rate", type=float, default=10_000.0, help="rate of all windows, Hz")
    parser.add_argument("--seconds", type=float, default=2.0, help="length of a window, whole seconds for cyclictest")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--stress", action="store_true", help="under load: every CPU busy, viewers, clients")
    given = parser.parse_args()
    why = {"cyclictest": why_no_cyclictest(), "hal": session.why_not()}
    absent = {peer: reason for peer, reason in why.items() if reason is not None}
    reason = why_no_realtime() or ("; ".join(absent.values()) if len(absent) == len(PEERS) else None)
    if reason is not None:
        print(json.dumps({"skipped": reason}) if given.json else f"skipped: {reason}")
        return 3
    with tempfile.TemporaryDirectory(prefix="rtb-", dir="/tmp") as folder:
        Path(folder).chmod(0o711)  # rtapi_app enters it as another user
        with busy() if given.stress else contextlib.nullcontext():
            result = measure(given.rate, given.seconds, given.rounds, absent, Path(folder), given.stress)
    print(json.dumps(result) if given.json else report(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
