"""Conditions on the results, such as `final_error_mm.p99 > 0.1`, that fail a campaign.

A condition is metric.statistic, a comparison and a number. Statistics ignore nan: `count` is the number of runs with a
value, `share` their share of all runs.
"""

import operator
import re
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError, nearest

PATTERN = re.compile(
    r"\s*([A-Za-z_][\w.]*)\.(\w+)\s*(<=|>=|==|!=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*"
)
COMPARE: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "min": np.min,
    "max": np.max,
    "mean": np.mean,
    "median": np.median,
    "p90": lambda x: np.percentile(x, 90),
    "p95": lambda x: np.percentile(x, 95),
    "p99": lambda x: np.percentile(x, 99),
}
COUNTS = ("count", "share")
OF_RUNS = ("trip", "error", "failed")  # metrics with only counts
REGRESSIONS = "regressions"  # against a baseline
EXAMPLE = "final_error_mm.p99 > 0.1"
LONGEST = 200  # characters


class Condition(NamedTuple):
    """Condition as text and in parts."""

    text: str
    metric: str
    statistic: str
    compare: str
    bound: float


class Judged(NamedTuple):
    """Result of a condition. Without a run with the metric, `value` is nan and the condition fails."""

    condition: Condition
    value: float
    failed: bool

    @property
    def words(self) -> str:
        """Result in a sentence."""
        c = self.condition
        if not np.isfinite(self.value):
            return f"--fail-on '{c.text}': no run has {c.metric}, so this cannot be judged"
        verb = "fails" if self.failed else "holds off"
        return f"--fail-on '{c.text}' {verb}: {c.metric}.{c.statistic} is {self.value:.6g}"


def parse(text: str, metrics: Iterable[str]) -> Condition:
    """Condition from text, on one of `metrics`. Raises UserError that names the wrong word."""
    match = PATTERN.fullmatch(text[:LONGEST])
    said = f"--fail-on '{text[:LONGEST]}'"
    if match is None:
        raise UserError(f"{said}: not a condition; write metric.statistic, a comparison and a number: '{EXAMPLE}'")
    name, statistic, compare, bound = match.groups()
    known = [*metrics, *OF_RUNS, REGRESSIONS]
    if name not in known:
        near = nearest(name, known)
        raise UserError(f"{said}: no metric '{name}'; " + (f"did you mean '{near}'?" if near else ", ".join(known)))
    usable = COUNTS[:1] if name == REGRESSIONS else COUNTS if name in OF_RUNS else (*STATISTICS, *COUNTS)
    if statistic not in usable:
        near = nearest(statistic, usable)
        hint = f"did you mean '{near}'?" if near else f"there is {', '.join(usable)}"
        raise UserError(f"{said}: {name} has no statistic '{statistic}'; {hint}")
    return Condition(text.strip(), name, statistic, compare, float(bound))


def judge(condition: Condition, columns: dict[str, np.ndarray], runs: int, regressions: int | None) -> Judged:
    """Result of a condition. `columns` has metrics (runs,) with nan, and flags of trip and error.

    Raises UserError for a condition on regressions without a baseline.
    """
    if condition.metric == REGRESSIONS:
        if regressions is None:
            raise UserError(
                f"--fail-on '{condition.text}': regressions are against a campaign; name it with --baseline"
            )
        value = float(regressions)
    else:
        value = statistic(condition.statistic, columns[condition.metric], runs)
    bad = not np.isfinite(value) or COMPARE[condition.compare](value, condition.bound)
    return Judged(condition, value, bool(bad))


def statistic(name: str, values: np.ndarray, runs: int) -> float:
    """Statistic of values (runs,) without nan; nan where all are nan."""
    if values.dtype == bool:
        values = values[values].astype(float)
    there: Any = values[np.isfinite(values)]
    if name == "count":
        return float(len(there))
    if name == "share":
        return len(there) / runs if runs else float("nan")
    return float(STATISTICS[name](there)) if len(there) else float("nan")
