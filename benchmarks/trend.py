"""Duration and scaling of a trend: recordings of an axis with growing friction, on 1 and on 2 Dask workers.

    python benchmarks/trend.py [--json] [--records N] [--scaled N] [--seconds T]

Wall time is that of `rtctl trend` with a process for each CPU. Clusters of 1 and 2 warm workers alternate on the first
N recordings. Wall time depends on other load. Therefore CPU times are also reported: W of the workers, S of scheduler
and client, which share two CPUs with the workers. `dask_speedup_by_cpu` is 2 W / (W + S), the speed-up on two otherwise
idle CPUs.
"""

import argparse
import json
import os
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.trend import trend
from rtctl.trend.pieces import Piece, pieces_of

WORKERS = (1, 2)
TARGET = {"wall_s": 600.0, "dask_speedup": 1.7}
RATE, COUNT = 1000.0, 1e-6  # Hz, m
MASS, VISCOUS, DRY = 95.0, 200.0, 20.0  # kg, Ns/m, N


@numba.njit(cache=True)
def carriage(force: np.ndarray, dt: float, mass: float, viscous: float, dry: float) -> np.ndarray:
    """Positions (n,) in m of a carriage with dry friction under a force (n,) in N, with 4 substeps per tick."""
    x, v = 0.0, 0.0
    out = np.empty(len(force))
    h = dt / 4
    for k in range(len(force)):
        out[k] = x
        for _ in range(4):
            pushed = v + h * (force[k] - viscous * v) / mass
            stop = h * dry / mass
            v = pushed - stop if pushed > stop else pushed + stop if pushed < -stop else 0.0
            x += h * v
    return out


def record(folder: Path, number: int, records: int, seconds: float) -> None:
    """Write a bundle of the carriage; its dry friction grows by 30 % after two thirds of the records."""
    rng = np.random.default_rng(number)
    n = int(seconds * RATE)
    t = np.arange(n) / RATE
    force = sum(60.0 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6.28)) for f in (0.4, 0.9, 2.1))
    dry = DRY * (1.3 if number >= 2 * records // 3 else 1.0) * (1.0 + 0.01 * rng.standard_normal())
    x = carriage(force, 1.0 / RATE, MASS, VISCOUS, dry)
    columns = {"t": t, "u": force, "x": COUNT * np.round(x / COUNT)}
    folder.mkdir(parents=True)
    pq.write_table(pa.table(columns), folder / "recording.parquet", compression="zstd")
    case = {
        "format": 2, "sample_rate": RATE, "delay_samples": 0.0, "group": "carriage",
        "machine": {
            "bodies": {"carriage": {"mass": MASS, "viscous": VISCOUS, "dry": DRY}},
            "drives": {"drive": {"body": "carriage", "column": "u", "unit": "N", "kind": "force", "gain": 1.0}},
            "sensors": {"scale": {"body": "carriage", "measures": "position", "column": "x", "resolution": COUNT}},
        },
        "tolerance": {"default": 0.5, "drives.drive.gain": 0.0},
        "controller": {"kind": "none"},
    }  # fmt: skip
    (folder / "case.json").write_text(json.dumps(case))


def everywhere(cluster: Any, function: Any, *arguments: Any) -> list[Any]:
    """Results of a function in each worker."""
    from distributed import Client

    with Client(cluster) as client:
        return list(client.run(function, *arguments).values())


def scaled(pieces: list[Piece], windows: int) -> dict[str, Any]:
    """Wall and CPU times of clusters of 1 and of 2 workers, alternately, and whether their rows are equal."""
    from distributed import LocalCluster

    clusters = {n: LocalCluster(n_workers=n, threads_per_worker=1, dashboard_address=None) for n in WORKERS}
    took: dict[int, list[float]] = {n: [] for n in WORKERS}
    rows: dict[int, Any] = {}
    workers, here = [], []
    try:
        for cluster in clusters.values():
            everywhere(cluster, trend.there, pieces[:1])
        for window in range(windows):
            for n in WORKERS if window % 2 == 0 else reversed(WORKERS):
                cpu, began = sum(everywhere(clusters[n], time.process_time)), time.process_time()
                before = time.perf_counter()
                found = {tuple(batch): made for batch, made in trend.computed(pieces, 1, clusters[n].scheduler_address)}
                took[n].append(time.perf_counter() - before)
                rows[n] = [found[batch] for batch in sorted(found)]
                if n == WORKERS[-1]:
                    here.append(time.process_time() - began)
                    workers.append(sum(everywhere(clusters[n], time.process_time)) - cpu)
    finally:
        for cluster in clusters.values():
            cluster.close()
    one, two = (statistics.median(took[n]) for n in WORKERS)
    W, S = statistics.median(workers), statistics.median(here)
    return {
        "dask_records": len(pieces),
        "dask_wall_s": {str(n): [round(s, 2) for s in took[n]] for n in WORKERS},
        "dask_speedup": round(one / two, 3),
        "dask_cpu_s": {"workers": round(W, 3), "scheduler_and_client": round(S, 3)},
        "dask_speedup_by_cpu": round(2.0 * W / (W + S), 3),
        "same_rows": rows[1] == rows[2],
    }


def measure(records: int, some: int, seconds: float, windows: int) -> dict[str, Any]:
    """All results, on temporary recordings."""
    folder = Path(tempfile.mkdtemp(prefix="rtctl-trend-"))
    try:
        for number in range(records):
            record(folder / "runs" / f"r{number:05d}", number, records, seconds)
        load, cpu = os.getloadavg()[0], os.times()
        found = trend.run([folder / "runs"], folder / "out", len(os.sched_getaffinity(0)))
        after = os.times()
        pieces = [piece for k in range(min(some, records)) for piece in pieces_of(folder / "runs" / f"r{k:05d}")]
        spent = sum(after[:4]) - sum(cpu[:4])
        return {
            "records": records,
            "seconds_each": seconds,
            "wall_s": found["wall_s"],
            "cpu_s": round(spent, 1),
            "changes": [
                f"{c['number']} {100 * c['change']:+.1f} % at {Path(c['folder']).name}" for c in found["changes"]
            ],
            **scaled(pieces, windows),
            "load": [round(load, 1), round(os.getloadavg()[0], 1)],
            "cpus": len(os.sched_getaffinity(0)),
            "target": TARGET,
        }
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--records", type=int, default=1000, help="recordings of the trend")
    parser.add_argument("--scaled", type=int, default=200, help="number of recordings that Dask workers compute")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of a recording")
    parser.add_argument("--windows", type=int, default=3, help="windows of each cluster, alternately")
    given = parser.parse_args()
    try:
        import distributed  # noqa: F401
    except ImportError:
        message = "Dask is not installed; pip install 'rtctl[dask]'"
        print(json.dumps({"skipped": message}) if given.json else message)
        return 3
    found = measure(given.records, given.scaled, given.seconds, given.windows)
    if given.json:
        print(json.dumps(found))
        return 0
    print(
        f"{found['records']} recordings of {given.seconds:g} s: {found['wall_s']:.0f} s wall, {found['cpu_s']:.0f} s "
        f"CPU (target {TARGET['wall_s']:.0f}); changes: {'; '.join(found['changes']) or 'none'}. Dask, 2 workers "
        f"against 1: {found['dask_speedup']:.2f} by wall, {found['dask_speedup_by_cpu']:.2f} by CPU time (target "
        f"{TARGET['dask_speedup']}), rows {'the same' if found['same_rows'] else 'DIFFER'}; load {found['load']}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
