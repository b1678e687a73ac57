"""Execution of a campaign: missing runs, result rows, bundles, report and summary."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from rtctl.campaign import conditions, keep, pools
from rtctl.campaign.compare import Comparison, compare
from rtctl.campaign.conditions import Condition, Judged
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import RESULTS, Store

SHOWN = ("min", "median", "p99", "max")  # statistics in a summary

Progress = Callable[[int, int, int], None]  # runs done, of how many, failed so far


def run(
    plan: Plan,
    folder: Path,
    jobs: int = 1,
    scheduler: str | None = None,
    fail_on: Sequence[Condition] = (),
    baseline: Path | None = None,
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """Run the missing runs of `folder`, and write table, bundles and report there; returns the summary of `--json`.

    Raises UserError where the folder holds another campaign, or where baseline or scheduler do not exist, and PoolError
    where a worker died.
    """
    began = time.monotonic()
    if baseline is not None:
        compare_early(plan, baseline)
    store = Store(folder, plan)
    done = store.done()
    left = [chunk for chunk in range(plan.chunks) if chunk not in done]
    count, bad = sum(len(plan.numbers(chunk)) for chunk in done), 0
    before = count
    progress(count, plan.runs, bad)
    for chunk, rows in pools.compute(plan, left, jobs, scheduler):
        store.add(chunk, rows)
        count += len(rows)
        bad += sum(bool(row["error"] or (row["trip"] and plan.payload["trips"] == "fail")) for row in rows)
        progress(count, plan.runs, bad)
    table = store.finish()
    ran = time.monotonic() - began
    compared = compare(plan, table, baseline) if baseline is not None else None
    judged = judge(plan, table, fail_on, compared)
    bundles = {number: keep.write(plan, number, folder) for number in keep.wanted(plan, table)}
    from rtctl.campaign import report

    page = report.write(plan, table, folder, bundles, compared, judged)
    return summary(plan, table, judged, compared) | {
        "computed": plan.runs - before,
        "wall_s": round(time.monotonic() - began, 3),
        "runs_s": round(ran, 3),
        "out": str(folder),
        "results": str(folder / RESULTS),
        "report": str(page),
        "bundles": [str(path) for path in bundles.values()],
    }


def compare_early(plan: Plan, baseline: Path) -> None:
    """Check the baseline before the runs. Raises UserError for an invalid baseline."""
    from rtctl.campaign.store import load_results

    load_results(baseline)


def judge(plan: Plan, table: pa.Table, given: Sequence[Condition], compared: Comparison | None) -> list[Judged]:
    """Results of the `given` conditions."""
    columns = {name: keep.values_of(table, name) for name in plan.metrics}
    columns |= {name: keep.flags(table, name) for name in ("trip", "error")} | {"failed": keep.failed(plan, table)}
    regressions = None if compared is None else compared.regressions
    return [conditions.judge(condition, columns, plan.runs, regressions) for condition in given]


def summary(plan: Plan, table: pa.Table, judged: Sequence[Judged], compared: Comparison | None) -> dict[str, Any]:
    """Summary of the table: counts and statistics, as printed by `--json`."""
    found: dict[str, Any] = {
        "campaign": plan.name,
        "hash": plan.identity,
        "runs": len(table),
        "failed": int(keep.failed(plan, table).sum()),
        "errors": int(keep.flags(table, "error").sum()),
        "trips": int(keep.flags(table, "trip").sum()),
        "metrics": {name: statistics(keep.values_of(table, name)) for name in plan.metrics},
        "fail_on": [
            {"condition": j.condition.text, "value": j.value, "failed": j.failed, "words": j.words} for j in judged
        ],
    }
    if compared is not None:
        found["baseline"] = {
            "folder": compared.folder,
            "matched": compared.matched,
            "regressions": compared.regressions,
            "worse": [_plain(c) for c in compared.of("worse")[:50]],
            "better": len(compared.of("better")),
            "broken": compared.broken[:50],
        }
    return found


def statistics(values: np.ndarray) -> dict[str, float]:
    """Statistics of a metric, and the number of runs that have it."""
    found = {name: conditions.statistic(name, values, len(values)) for name in SHOWN}
    return {**found, "count": int(np.isfinite(values).sum())}


def _plain(change: Any) -> dict[str, Any]:
    return {"metric": change.metric, **change.group, "baseline": change.baseline, "now": change.now}
