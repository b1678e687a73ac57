"""Report of a campaign: one self-contained HTML file with links to the bundles beside it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from jinja2 import Environment, PackageLoader, StrictUndefined

from rtctl import __version__
from rtctl.campaign import cell, conditions, figures, keep
from rtctl.campaign.compare import BETTER, LEAST, LEVEL, SEED, SMALL, UNKNOWN, WORSE, Change, Comparison
from rtctl.campaign.conditions import Judged
from rtctl.campaign.listing import axes_words
from rtctl.campaign.metrics import METRICS
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import load_results
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.files import write_text

REPORT = "report.html"
MOST_ROWS = 12  # rows in the table of an axis; a longer axis is cut into this many sections
MOST_LISTED = 100  # listed failures and regressions
OVERLAYS = 3  # most configs with drawn steps
WORST = 10
RULE = (
    f"Runs that differ only in loop.seed are a group. A group of {LEAST} or more runs is a regression where the mean "
    f"difference is significantly worse by Student's t (familywise error rate {100 * LEVEL:.0f} % for the whole "
    f"comparison) and more than {100 * SMALL:.0f} % of the baseline. A smaller group, whose noise is unknown, is a "
    f"regression above {100 * UNKNOWN:.0f} %. A run that newly fails is a regression, "
    "and so is a run that lost a metric, such as a step that no longer settles."
)


class Picture(NamedTuple):
    png: str
    alt: str


def write(
    plan: Plan,
    table: pa.Table,
    folder: Path,
    bundles: Mapping[int, Path],
    compared: Comparison | None = None,
    judged: Sequence[Judged] = (),
) -> Path:
    """Write report.html into the campaign's folder; returns its path. Raises UserError where the write fails."""
    path = folder / REPORT
    try:
        write_text(path, html(plan, table, bundles, compared, judged))
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
    return path


def html(
    plan: Plan,
    table: pa.Table,
    bundles: Mapping[int, Path],
    compared: Comparison | None = None,
    judged: Sequence[Judged] = (),
) -> str:
    """HTML text of the report."""
    env = Environment(
        loader=PackageLoader("rtctl.campaign", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    values = {name: keep.values_of(table, name) for name in plan.metrics}
    values = {name: x for name, x in values.items() if np.isfinite(x).any()}
    bad = keep.failed(plan, table)
    return env.get_template("report.html.j2").render(
        name=plan.name,
        verdict=verdict(plan, bad, judged, compared),
        ok=not (bad.any() or any(j.failed for j in judged)),
        judged=[(j.words, j.failed) for j in judged],
        statistics=[statistics(name, x) for name, x in values.items()],
        overlays=overlays(plan, table, bad),
        distributions=distributions(values, compared),
        failures=[failure(plan, table, int(n), bundles) for n in np.flatnonzero(bad)[:MOST_LISTED]],
        more_failures=max(int(bad.sum()) - MOST_LISTED, 0),
        by=plan.keep.by,
        worst=[worst(plan, table, n, bundles) for n in keep.worst(plan, table, plan.keep.by, WORST)],
        axes=[axis_table(plan, table, i, values, bad) for i in range(len(plan.axes)) if has_order(plan, i)],
        compared=None if compared is None else comparison(compared, plan),
        rule=RULE,
        footer=f"rtctl {__version__}, campaign {plan.identity[:12]}; every run is exact and can be had again.",
    )


def verdict(plan: Plan, bad: np.ndarray, judged: Sequence[Judged], compared: Comparison | None) -> str:
    """Verdict of the campaign in one to three sentences."""
    words = [f"{len(bad)} runs, {int(bad.sum()) or 'none'} failed."]
    hit = sum(j.failed for j in judged)
    if judged:
        words.append(f"{hit} of {len(judged)} conditions fail." if hit else "No condition fails the campaign.")
    if compared is not None:
        words.append(f"{compared.regressions or 'No'} regressions against {Path(compared.folder).name}.")
    return " ".join(words)


def statistics(name: str, x: np.ndarray) -> list[str]:
    """Row of a metric in the table of metrics."""
    metric = METRICS[name]
    numbers = [conditions.statistic(s, x, len(x)) for s in ("min", "median", "p90", "p99", "max")]
    return [f"{name}", metric.words, *(f"{v:.4g}" for v in numbers), str(int(np.isfinite(x).sum()))]


def overlays(plan: Plan, table: pa.Table, bad: np.ndarray) -> list[Picture]:
    """Overlaid steps, one picture for each config: evenly spaced runs and the worst runs."""
    groups: dict[str, list[int]] = {}
    configs = table["config"].to_pylist() if "config" in plan.columns else [""] * len(table)
    for number, config in enumerate(configs):
        groups.setdefault(str(config), []).append(number)
    red = {*keep.worst(plan, table, plan.keep.by, 3), *np.flatnonzero(bad)[:5].tolist()}
    pictures = []
    for config, numbers in list(groups.items())[:OVERLAYS]:
        evenly = np.linspace(0, len(numbers) - 1, min(figures.MOST_LINES, len(numbers))).round().astype(int)
        chosen = dict.fromkeys([numbers[i] for i in evenly] + [n for n in numbers if n in red])
        lines = [one for n in chosen if (one := _line(plan, n, n in red)) is not None]
        if lines:
            title = f"{config or plan.name}: {len(lines)} of {len(numbers)} runs"
            pictures.append(Picture(figures.png(figures.overlay(lines, title)), f"Steps and errors of {title}."))
    return pictures


def _line(plan: Plan, number: int, bad: bool) -> figures.Line | None:
    try:
        return figures.line(cell.play(plan, number), bad)
    except (UserError, NoAnswer, ValueError, ArithmeticError, MemoryError):
        return None


def distributions(values: dict[str, np.ndarray], compared: Comparison | None) -> Picture | None:
    """Picture of the histograms of all metrics."""
    if not values:
        return None
    before = {}
    if compared is not None:
        plan, old = load_results(compared.folder)
        before = {name: keep.values_of(old, name) for name in values if name in plan.metrics}
    return Picture(figures.png(figures.distributions(values, before)), "Histograms of all metrics.")


def failure(plan: Plan, table: pa.Table, number: int, bundles: Mapping[int, Path]) -> dict[str, Any]:
    """Entry of a failed run."""
    row = table.slice(number, 1).to_pylist()[0]
    why = row["error"] or f"trip: {row['trip']}"
    return {**_entry(plan, row, number, bundles), "why": why}


def worst(plan: Plan, table: pa.Table, number: int, bundles: Mapping[int, Path]) -> dict[str, Any]:
    """Entry of one of the worst runs."""
    row = table.slice(number, 1).to_pylist()[0]
    return {**_entry(plan, row, number, bundles), "value": f"{row[plan.keep.by]:.5g}", "trip": row["trip"]}


def _entry(plan: Plan, row: dict[str, Any], number: int, bundles: Mapping[int, Path]) -> dict[str, Any]:
    link = f"{keep.FOLDER}/{keep.name_of(number)}/" if number in bundles else ""
    return {"run": number, "axes": axes_words({name: row[name] for name in plan.columns}), "link": link}


def has_order(plan: Plan, index: int) -> bool:
    """Whether an axis gets a table: it has several values and they are no seeds."""
    paths = [path for column in plan.axes[index] for path in column["paths"]]
    return plan.shape[index] > 1 and paths != [SEED]


def axis_table(plan: Plan, table: pa.Table, index: int, values: Mapping[str, np.ndarray], bad: np.ndarray) -> Any:
    """Table of an axis, with a row for each value or section, and a picture of the metric `keep.by`."""
    axis, by = plan.axes[index], plan.keep.by
    stride = int(np.prod(plan.shape[index + 1 :], dtype=int))
    places = np.arange(plan.runs) // stride % plan.shape[index]
    order = np.arange(plan.shape[index])
    pieces = np.array_split(order, min(len(order), MOST_ROWS))
    rows = []
    for piece in pieces:
        mine = (places >= piece[0]) & (places <= piece[-1])
        rows.append([_span(axis, piece), str(int(mine.sum())), str(int(bad[mine].sum())), *_three(values, by, mine)])
    first = axis[0]
    picture = None
    if by in values:
        groups = [values[by][places == place] for place in order]
        drawn = figures.along(first["name"], first["unit"], first["labels"], groups, by)
        picture = Picture(figures.png(drawn), f"{by} along {first['name']}.")
    return {"name": ", ".join(c["name"] for c in axis), "rows": rows, "picture": picture}


def _span(axis: Any, piece: np.ndarray) -> str:
    """First and last value of a section of an axis, for each column."""
    said = []
    for column in axis:
        ends = [column["labels"][i] for i in dict.fromkeys((int(piece[0]), int(piece[-1])))]
        shown = " to ".join(f"{x:.5g}" if isinstance(x, float) else str(x) for x in ends)
        name = f"{column['name']} " if len(axis) > 1 else ""
        said.append(f"{name}{shown} {column['unit']}".strip())
    return ", ".join(said)


def _three(values: Mapping[str, np.ndarray], by: str, mine: np.ndarray) -> list[str]:
    if by not in values:
        return ["-"] * 3
    found = [conditions.statistic(s, values[by][mine], int(mine.sum())) for s in ("median", "p99", "max")]
    return [f"{x:.4g}" if np.isfinite(x) else "-" for x in found]


def comparison(compared: Comparison, plan: Plan) -> dict[str, Any]:
    """Changes against the baseline: a row for each metric, and the groups that got worse."""
    worse, better = compared.of(WORSE), compared.of(BETTER)
    metrics = []
    for name in dict.fromkeys(c.metric for c in compared.changes):
        mine = [c for c in compared.changes if c.metric == name]
        there = [c for c in mine if np.isfinite(c.now)]
        weight = sum(c.runs for c in there)
        old, new = (
            sum(c.runs * getattr(c, k) for c in there) / weight if weight else np.nan for k in ("baseline", "now")
        )
        counts = [sum(c.verdict == v for c in mine) for v in (WORSE, BETTER)]
        metrics.append((name, number(old), number(new), number(new - old, "+.3g"), *map(str, counts), str(len(mine))))
    return {
        "folder": compared.folder,
        "matched": compared.matched,
        "metrics": metrics,
        "worse": [_change_row(c) for c in worse[:MOST_LISTED]],
        "more": max(len(worse) - MOST_LISTED, 0),
        "better": len(better),
        "broken": compared.broken[:MOST_LISTED],
        "mended": len(compared.mended),
    }


def _change_row(c: Change) -> list[str]:
    noise = f"{c.noise:.2g}" if np.isfinite(c.noise) else "not known"
    group = axes_words(c.group) or "all runs"
    return [c.metric, group, number(c.baseline), number(c.now), number(c.change, "+.3g"), noise, str(c.runs)]


def number(value: float, form: str = ".5g") -> str:
    """Text of a number in a table; "none" for nan."""
    return format(value, form) if np.isfinite(value) else "none"
