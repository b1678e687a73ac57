"""Comparison of a campaign with a baseline campaign: significant changes of metrics, by groups of runs.

Runs are matched by their values on the common axes. Runs that differ only in `loop.seed` are a group: their differences
new - old (n,) are repeated measurements of one change. A group got worse where

- n >= 3: the mean difference is worse than t(0.01 / tests, n - 1) standard errors, a familywise error rate of 1 %, and
  more than 1 % of the baseline
- n < 3: the noise is unknown, and the mean difference is more than 5 % of the baseline
- a run lost the metric, such as a step that no longer settles

Source: Student's t with Bonferroni's correction, e.g. Montgomery, Design and Analysis of Experiments, 3.5.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from scipy.stats import t as student

from rtctl.campaign.keep import failed, values_of
from rtctl.campaign.metrics import METRICS
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import load_results
from rtctl.config.errors import UserError

SEED = "loop.seed"
LEVEL = 0.01  # familywise error rate of a comparison
SMALL = 0.01  # share of the baseline: least change that counts
UNKNOWN = 0.05  # share of the baseline: least change that counts with fewer than LEAST seeds
LEAST = 3  # matching runs needed to estimate the noise
TRIP_TIME = "trip_s"  # only tripped runs have this metric
NAN = float("nan")
SAME, BETTER, WORSE = "same", "better", "worse"


class Change(NamedTuple):
    """One metric in one group of matching runs. `noise` is one standard error of `change`, nan where unknown.

    `now` is nan where the runs lost the metric.
    """

    metric: str
    group: dict[str, Any]
    runs: int
    baseline: float
    now: float
    noise: float
    verdict: str

    @property
    def change(self) -> float:
        return self.now - self.baseline


class Comparison(NamedTuple):
    """All changes; numbers (in the new campaign) of runs that newly fail and of runs that no longer fail."""

    folder: str
    matched: int
    changes: list[Change]
    broken: list[int]
    mended: list[int]

    def of(self, verdict: str) -> list[Change]:
        """Changes with one verdict: lost metrics first, then by decreasing share of the baseline."""
        found = [c for c in self.changes if c.verdict == verdict]
        return sorted(found, key=lambda c: -abs(c.change) / max(abs(c.baseline), 1e-12) if c.now == c.now else -np.inf)

    @property
    def regressions(self) -> int:
        """Number of groups that got worse and of runs that newly fail."""
        return len(self.of(WORSE)) + len(self.broken)


def compare(plan: Plan, table: pa.Table, folder: Path | str) -> Comparison:
    """Comparison with the campaign in `folder`. Raises UserError where it is no campaign or no run matches."""
    old_plan, old = load_results(folder)
    axes = [name for name in plan.columns if name in old_plan.columns]
    groups = [name for name in axes if name != SEED]
    here, there = (_keys(t, axes) for t in (table, old))
    for keys, whose in ((here, "this campaign"), (there, str(folder))):
        if len(set(keys)) < len(keys):
            lacking = sorted(set(plan.columns) ^ set(old_plan.columns))
            raise UserError(
                f"--baseline {folder}: runs of {whose} cannot be told apart by the axes that both have "
                f"({', '.join(axes) or 'none'}); only one of the two has {', '.join(lacking)}"
            )
    index = {key: i for i, key in enumerate(there)}
    pairs = np.array([(i, index[key]) for i, key in enumerate(here) if key in index], dtype=int).reshape(-1, 2)
    if not len(pairs):
        raise UserError(f"--baseline {folder}: no run of it has the same {', '.join(axes)}; nothing to compare")
    new_bad, old_bad = failed(plan, table)[pairs[:, 0]], failed(old_plan, old)[pairs[:, 1]]
    members = _groups(table, groups, pairs[:, 0])
    metrics = [m for m in plan.metrics if m in old_plan.metrics]
    tests = max(len(members) * len(metrics), 1)
    changes = []
    for metric in metrics:
        a, b = values_of(table, metric)[pairs[:, 0]], values_of(old, metric)[pairs[:, 1]]
        both = np.isfinite(a) & np.isfinite(b)
        for key, rows in members.items():
            used = rows[both[rows]]
            lost = rows[np.isfinite(b[rows]) & ~np.isfinite(a[rows]) & ~new_bad[rows]]
            if len(lost) and metric != TRIP_TIME:
                told = dict(zip(groups, key, strict=True))
                changes.append(Change(metric, told, len(lost), float(b[lost].mean()), NAN, NAN, WORSE))
            if len(used):
                changes.append(_change(metric, dict(zip(groups, key, strict=True)), b[used], a[used], tests))
    broken, mended = pairs[new_bad & ~old_bad, 0], pairs[old_bad & ~new_bad, 0]
    return Comparison(str(folder), len(pairs), changes, broken.tolist(), mended.tolist())


def _keys(table: pa.Table, names: list[str]) -> list[tuple]:
    columns = [table[name].to_pylist() for name in names]
    return list(zip(*columns, strict=True)) if columns else [()] * len(table)


def _groups(table: pa.Table, names: list[str], rows: np.ndarray) -> dict[tuple, np.ndarray]:
    """Indices in `rows` of each combination of values."""
    found: dict[tuple, list[int]] = {}
    for place, key in enumerate(_keys(table.take(rows), names)):
        found.setdefault(key, []).append(place)
    return {key: np.array(places) for key, places in found.items()}


def _change(metric: str, group: dict[str, Any], old: np.ndarray, new: np.ndarray, tests: int) -> Change:
    """Change and verdict of one group, by the rule in the module docstring."""
    d, n = new - old, len(new)
    mean, scale = float(d.mean()), abs(float(old.mean()))
    if n >= LEAST:
        noise = float(d.std(ddof=1)) / n**0.5
        beyond = max(float(student.isf(LEVEL / tests, n - 1)) * noise, SMALL * scale)
    else:
        noise, beyond = float("nan"), UNKNOWN * scale
    verdict = SAME
    if abs(mean) > beyond:
        verdict = WORSE if mean * METRICS[metric].worse > 0 else BETTER
    return Change(metric, group, n, float(old.mean()), float(new.mean()), noise, verdict)
