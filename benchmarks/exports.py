"""Time and size of each export of a long recording, measured alternately on one machine.

    python benchmarks/exports.py [--json] [--minutes M] [--to mcap,mcap-json,parquet]

The recording has 22 columns at 10 kHz: a clock, two integers, and sines with noise. `share` is the time of an export
over that of `mcap-json`. 12 minutes are 7.2 million rows and take 3 GB of disk space.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.trace.bundle import ROW_GROUP, save_case
from rtctl.trace.export import export

RATE, COLUMNS = 10_000, 19
OF = "mcap-json"


def record(folder: Path, minutes: float) -> int:
    """Write a bundle; returns its number of rows."""
    noise, rows = np.random.default_rng(0), round(minutes * 60 * RATE)
    names = ["t", "tick", "state", *(f"c{k}" for k in range(COLUMNS))]
    kinds = [pa.float64(), pa.int64(), pa.int64(), *[pa.float64()] * COLUMNS]
    schema = pa.schema([pa.field(*field, nullable=False) for field in zip(names, kinds, strict=True)])
    with pq.ParquetWriter(folder / "recording.parquet", schema, compression="zstd") as writer:
        for first in range(0, rows, ROW_GROUP):
            tick = np.arange(first, min(rows, first + ROW_GROUP))
            t = tick / RATE
            waves = [np.sin(t * (k + 1)) + 1e-3 * noise.standard_normal(len(t)) for k in range(COLUMNS)]
            writer.write_batch(pa.record_batch([t, tick, np.full(len(t), 2), *waves], schema=schema))
    save_case(folder, {"format": 1, "plant": "ivu", "sample_rate": RATE, "recorded_at": "2026-01-01T00:00:00+00:00"})
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--to", default=f"mcap,{OF},parquet,csv")
    args = parser.parse_args()
    found = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = record(folder, args.minutes)
        for to in args.to.split(","):
            began = time.perf_counter()
            done = export(folder, to, folder / "out")
            found[to] = {"seconds": round(time.perf_counter() - began, 2), "megabytes": round(done.bytes / 1e6, 1)}
            done.path.unlink()
    for each in found.values():
        each["share"] = round(each["seconds"] / found[OF]["seconds"], 4) if OF in found else None
    if args.json:
        print(json.dumps({"minutes": args.minutes, "rows": rows, "exports": found}))
        return
    print(f"{rows} rows of {COLUMNS + 3} columns")
    for to, each in found.items():
        share = "" if each["share"] is None else f"  {each['share']:.3f} of {OF}"
        print(f"{to:10}{each['seconds']:8.2f} s{each['megabytes']:9.1f} MB{share}")


if __name__ == "__main__":
    main()
