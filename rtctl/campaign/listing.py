"""The runs of a campaign that failed, and the worst of the others, for `rtctl campaign list`."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from rtctl.campaign import keep
from rtctl.campaign.plan import Plan
from rtctl.config.errors import UserError, nearest

MOST = 50  # failures in the terminal


def listing(plan: Plan, table: pa.Table, folder: Path, count: int, by: str | None = None) -> dict[str, Any]:
    """Failures and the `count` worst runs by a metric, each with axes, reason or value, and bundle.

    Raises UserError where the campaign has no such metric.
    """
    by = by or plan.keep.by
    if by not in plan.metrics:
        near = nearest(by, plan.metrics)
        raise UserError(f"--by {by}: " + (f"did you mean '{near}'?" if near else f"there is {', '.join(plan.metrics)}"))
    bad = keep.failed(plan, table)
    numbers = [n for n in keep.worst(plan, table, by, len(table)) if not bad[n]][:count]
    return {
        "campaign": plan.name,
        "runs": len(table),
        "failed": int(bad.sum()),
        "by": by,
        "failures": [entry(plan, table, folder, int(n), by) for n in np.flatnonzero(bad)],
        "worst": [entry(plan, table, folder, n, by) for n in numbers],
    }


def entry(plan: Plan, table: pa.Table, folder: Path, number: int, by: str) -> dict[str, Any]:
    """Entry of one run: axes, metric, trip, error and bundle."""
    row = table.slice(number, 1).to_pylist()[0]
    bundle = folder / keep.FOLDER / keep.name_of(number)
    return {
        "run": number,
        "axes": {name: row[name] for name in plan.columns},
        by: row[by],
        "trip": row["trip"],
        "error": row["error"],
        "bundle": str(bundle) if bundle.is_dir() else None,
    }


def axes_words(axes: dict[str, Any]) -> str:
    """Values of a run's axes, as text in one line."""
    return ", ".join(
        f"{name}={value:.6g}" if isinstance(value, float) else f"{name}={value}" for name, value in axes.items()
    )


def words(found: dict[str, Any]) -> list[str]:
    """Lines of the list for a terminal."""
    lines = [f"{found['campaign']}: {found['runs']} runs, {found['failed']} failed"]
    for e in found["failures"][:MOST]:
        lines.append(f"  run {e['run']:<8}{e['error'] or 'trip: ' + e['trip']}; {axes_words(e['axes'])}")
        if e["bundle"]:
            lines.append(f"  {'':12}{e['bundle']}")
    if len(found["failures"]) > MOST:
        lines.append(f"  and {len(found['failures']) - MOST} more; see --json")
    lines.append(f"worst by {found['by']}:")
    for e in found["worst"]:
        lines.append(f"  run {e['run']:<8}{e[found['by']]:<12.5g}{axes_words(e['axes'])}")
        if e["bundle"]:
            lines.append(f"  {'':12}{e['bundle']}")
    return lines
