"""Bundles of selected runs, written by a second run: virtual time reproduces the rows."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from rtctl.campaign import cell
from rtctl.campaign.metrics import METRICS
from rtctl.campaign.plan import Plan
from rtctl.config.errors import UserError
from rtctl.config.files import made_in
from rtctl.daemon.case import describe
from rtctl.loop.fused import Run
from rtctl.trace.bundle import PARQUET, save_case, write_parquet
from rtctl.trace.columns import record_batch, schema
from rtctl.trace.orders import ORDERS, Journal

FOLDER = "bundles"


def worst(plan: Plan, table: pa.Table, by: str, count: int) -> list[int]:
    """Numbers of the worst runs by a metric, worst first; runs without the metric are left out."""
    values = METRICS[by].worse * values_of(table, by)
    order = np.argsort(-values, kind="stable")
    return [int(i) for i in order if np.isfinite(values[i])][:count]


def values_of(table: pa.Table, name: str) -> np.ndarray:
    """Values (n,) of a metric of all runs, nan for runs without it."""
    return table[name].to_numpy(zero_copy_only=False).astype(float)


def flags(table: pa.Table, name: str) -> np.ndarray:
    """Mask (n,) of runs with a text in the column `trip` or `error`."""
    return np.array([bool(text) for text in table[name].to_pylist()], dtype=bool)


def failed(plan: Plan, table: pa.Table) -> np.ndarray:
    """Mask (n,) of failed runs: an error, or a trip where the plan counts it as a failure."""
    found = flags(table, "error")
    return found | flags(table, "trip") if plan.payload["trips"] == "fail" else found


def wanted(plan: Plan, table: pa.Table) -> list[int]:
    """Numbers of the runs that get a bundle."""
    keep = plan.keep
    runnable = ~flags(table, "error")
    if keep.bundles == "none":
        return []
    if keep.bundles == "all":
        return np.flatnonzero(runnable).tolist()
    tripped = np.flatnonzero(flags(table, "trip") & runnable)[: keep.failures]
    return list(dict.fromkeys([*worst(plan, table, keep.by, keep.worst), *tripped.tolist()]))


def name_of(run: int) -> str:
    """Folder of a run's bundle, under `bundles`."""
    return f"run-{run:06d}"


def write(plan: Plan, number: int, folder: Path) -> Path:
    """Write the bundle of a run unless it exists; returns its folder. Raises UserError where a write fails."""
    bundle = folder / FOLDER / name_of(number)
    if (bundle / PARQUET).is_file():
        return bundle
    run = cell.play(plan, number)
    try:
        made_in(folder, FOLDER, name_of(number))
        save_case(bundle, case_of(plan, number, run))
        journal = Journal()
        journal.note(run.loop.c[0], {})
        (bundle / ORDERS).unlink(missing_ok=True)
        journal.open(bundle)
        journal.close()
        columns = run.loop.made.columns
        form = schema(columns, run.rows.dtype)
        write_parquet(bundle, [record_batch(run.rows, form)], form)
    except OSError as error:
        raise UserError(f"{bundle}: cannot be written: {error.strerror or error}") from None
    return bundle


def case_of(plan: Plan, number: int, run: Run) -> dict[str, Any]:
    """case.json of a run: the case of its machine, and campaign and run number."""
    case = describe(run.loop.machine, run.loop.made)
    told = {"name": plan.name, "hash": plan.identity, "run": number, **plan.labels(number)}
    return {**case, "complete": True, "campaign": told}
