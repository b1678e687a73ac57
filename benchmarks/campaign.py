"""Scaling of a campaign: a local Dask cluster with 1 worker and with 2, alternately, on equal runs.

    python benchmarks/campaign.py [--json] [--runs N] [--windows N]

Each window computes runs of configs/campaigns/radii_10000.yaml. Workers are warm: each has computed a chunk before.

Wall time depends on other load. Therefore CPU times are also reported: W of the workers, S of scheduler and client,
which share two CPUs with the workers. `speed_up_by_cpu` is 2 W / (W + S), the speed-up on two otherwise idle CPUs.
"""

import argparse
import json
import os
import statistics
import sys
import time
from typing import Any

from rtctl.campaign import pools
from rtctl.campaign.cell import run_chunk
from rtctl.campaign.plan import Plan, load_plan
from rtctl.cli.common import load_config

CAMPAIGN = "radii_10000"
WORKERS = (1, 2)
TARGET = 1.7


def timed(plan: Plan, chunks: range, scheduler: str) -> tuple[float, list[Any]]:
    """Wall time in s for these chunks, including the connection to the scheduler, and their rows in order."""
    before = time.perf_counter()
    found = dict(pools.compute(plan, chunks, 1, scheduler))
    return time.perf_counter() - before, [found[chunk] for chunk in chunks]


def everywhere(cluster: Any, function: Any, *arguments: Any) -> list[Any]:
    """Results of a function in each worker."""
    from distributed import Client

    with Client(cluster) as client:
        return list(client.run(function, *arguments).values())


def measure(runs: int, windows: int) -> dict[str, Any]:
    """Wall times of both clusters, measured alternately, and whether their rows are equal."""
    from distributed import LocalCluster

    plan = load_plan(CAMPAIGN, load_config)
    chunks = range(-(-min(runs, plan.runs) // plan.chunk))
    clusters = {n: LocalCluster(n_workers=n, threads_per_worker=1, dashboard_address=None) for n in WORKERS}
    took: dict[int, list[float]] = {n: [] for n in WORKERS}
    rows: dict[int, list[Any]] = {}
    load = [os.getloadavg()[0]]
    workers, here = [], []  # CPU s of the windows with 2 workers
    try:
        for cluster in clusters.values():
            everywhere(cluster, run_chunk, plan.payload, plan.identity, 0)
        for window in range(windows):
            for n in WORKERS if window % 2 == 0 else reversed(WORKERS):
                before, began = sum(everywhere(clusters[n], time.process_time)), time.process_time()
                seconds, rows[n] = timed(plan, chunks, clusters[n].scheduler_address)
                took[n].append(seconds)
                if n == WORKERS[-1]:
                    here.append(time.process_time() - began)
                    workers.append(sum(everywhere(clusters[n], time.process_time)) - before)
            load.append(os.getloadavg()[0])
    finally:
        for cluster in clusters.values():
            cluster.close()
    one, two = (statistics.median(took[n]) for n in WORKERS)
    W, S = statistics.median(workers), statistics.median(here)
    done = sum(len(plan.numbers(chunk)) for chunk in chunks)
    return {
        "runs": done,
        "windows": windows,
        "wall_s": {str(n): [round(s, 3) for s in took[n]] for n in WORKERS},
        "ms_a_run_one_worker": round(1000.0 * one / done, 3),
        "speed_up": round(one / two, 3),
        "cpu_s": {"workers": round(W, 3), "scheduler_and_client": round(S, 3)},
        "speed_up_by_cpu": round(2.0 * W / (W + S), 3),
        "same_rows": rows[1] == rows[2],
        "load": [round(x, 2) for x in load],
        "cpus": len(os.sched_getaffinity(0)),
        "target": {"speed_up": TARGET},
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--runs", type=int, default=4000, help="runs of a window")
    parser.add_argument("--windows", type=int, default=5, help="windows of each cluster, alternately")
    given = parser.parse_args()
    try:
        import distributed  # noqa: F401
    except ImportError:
        message = "Dask is not installed; pip install 'rtctl[dask]'"
        print(json.dumps({"skipped": message}) if given.json else message)
        return 3
    result = measure(given.runs, given.windows)
    if given.json:
        print(json.dumps(result))
        return 0
    print(
        f"{result['runs']} runs: speed-up {result['speed_up']:.2f} with 2 workers against 1 (target {TARGET}), "
        f"{result['speed_up_by_cpu']:.2f} by CPU time, "
        f"{result['ms_a_run_one_worker']:.2f} ms a run, rows {'the same' if result['same_rows'] else 'DIFFER'}; "
        f"load {result['load'][0]:.1f} to {max(result['load']):.1f} on {result['cpus']} CPUs"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
