"""Common functions of diagnosis benchmarks: generate, diagnose, score and print cases."""

import argparse
import json
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from lateness import rtctl_command

Hidden = TypeVar("Hidden")  # content of a case
USUAL = {"format": 1, "plant": "axis", "delay_samples": 0.0, "reaches": {"parameter_tolerance": 0.15}}


def write(folder: Path, columns: dict[str, np.ndarray], case: dict[str, Any]) -> None:
    """Write a bundle of columns (n,) to a new folder; `ref` defaults to 0, `case` to USUAL."""
    folder.mkdir(parents=True)
    zero = np.zeros(len(columns["t"]))
    pq.write_table(pa.table({"t": zero, "ref": zero, "w": zero, **columns}), folder / "recording.parquet")
    (folder / "case.json").write_text(json.dumps({**USUAL, **case}))


def run(
    text: str | None,
    conceal: Callable[[Path, int, int], Hidden],
    judged: Callable[[dict[str, Hidden], Path], dict[str, Any]],
    told: Callable[[dict[str, Any]], list[str]],
    count: int,
    seed: int,
) -> None:
    """Command line of a benchmark with help `text` and default `count` and `seed`.

    `conceal(folder, seed, k)` writes case k, `judged(hidden, folder)` scores the diagnoses, `told(found)` returns the
    result as lines.
    """
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--seed", type=int, default=seed)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, help="folder that keeps cases and diagnoses")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rtb-", dir="/tmp") as name:
        out = given.out or Path(name)
        cases = {f"case-{k:04d}": conceal(out / "cases" / f"case-{k:04d}", given.seed, k) for k in range(given.count)}
        command = (*rtctl_command(), "diagnose", str(out / "cases"), "--out", str(out / "told"))
        subprocess.run((*command, "--jobs", str(given.jobs)), check=True, capture_output=True)
        found = judged(cases, out / "told")
    if given.json:
        print(json.dumps(found))
        return
    print(*told(found), *(f"{case}: {entry}" for case, entry in found["others"].items()), sep="\n")
