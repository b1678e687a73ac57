"""Figures of a campaign report: overlaid steps, distributions, and metrics along the axes."""

import base64
import io
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.campaign.metrics import METRICS
from rtctl.loop.fused import Run
from rtctl.tick import safety

INK, BLUE, RED, GREY, GREEN = "#222222", "#0b62a8", "#b3262e", "#8a8f98", "#2e8b57"
POINTS = 1200  # most points of a line
BINS = 40
MOST_LINES = 40


class Line(NamedTuple):
    """Run of the overlay: time in s from the start of its reference, position and error in mm."""

    t: np.ndarray
    target: np.ndarray
    position: np.ndarray
    error: np.ndarray  # shaped reference - position
    bad: bool


def line(run: Run, bad: bool) -> Line | None:
    """Line of the part of a run in which the machine ran; None where it never ran."""
    rows = run.rows[run.rows["state"] == safety.RUNNING]
    if len(rows) < 2:
        return None
    machine = run.loop.machine
    mm = 1000.0 * (machine.metres_per_unit or 1.0)  # for an angle: thousandths of its unit
    kept = rows[:: max(1, len(rows) // POINTS)]
    y = kept[machine.signals.position]
    origin = kept["target"][0]
    error = mm * kept[machine.signals.error]
    return Line(kept["t"] - rows["t"][0], mm * (kept["target"] - origin), mm * (y - y[0]), error, bad)


def overlay(lines: Sequence[Line], title: str) -> Figure:
    """Figure of position and error of several runs over the time of the reference; bad runs in red on top."""
    figure = _figure(9.0, 5.2)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    ordered = sorted(lines, key=lambda one: one.bad)
    plain = sum(not one.bad for one in lines)
    alpha = float(np.clip(8.0 / max(plain, 1), 0.25, 0.8))
    for one in ordered:
        pen: dict[str, Any] = (
            {"color": RED, "linewidth": 1.0} if one.bad else {"color": BLUE, "linewidth": 0.8, "alpha": alpha}
        )
        above.plot(one.t, one.position, **pen)
        below.plot(one.t, one.error, **pen)
    targets = {one.target.tobytes(): one for one in lines}
    for i, one in enumerate(list(targets.values())[:5]):
        above.plot(one.t, one.target, color=INK, linewidth=0.9, linestyle=(0, (4, 3)), label=None if i else "target")
    above.plot([], [], color=BLUE, label=f"{plain} runs, evenly chosen")
    if plain < len(lines):
        above.plot([], [], color=RED, label=f"{len(lines) - plain} worst or tripped")
    above.legend(loc="best", fontsize=8, frameon=False)
    above.set_title(title, loc="left", fontsize=10)
    above.set_ylabel("position, mm")
    below.set_ylabel("reference - position, mm")
    below.set_xlabel("time of the reference, s")
    _style(above, below)
    return figure


def distributions(metrics: dict[str, np.ndarray], before: dict[str, np.ndarray]) -> Figure:
    """Figure with a histogram of each metric, median and 99th percentile; `before` is a baseline, drawn as outline."""
    columns = min(3, len(metrics))
    lines = -(-len(metrics) // columns)
    figure = _figure(3.1 * columns, 2.3 * lines)
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes in panels[len(metrics) :]:
        axes.set_visible(False)
    for axes, (name, values) in zip(panels, metrics.items(), strict=False):
        x = values[np.isfinite(values)]
        old = before.get(name, np.zeros(0))
        old = old[np.isfinite(old)]
        both = np.concatenate((x, old))
        low, high = float(both.min()), float(both.max())
        room = (0.5 * abs(low) or 0.5) if high - low <= 1e-9 * max(abs(low), abs(high)) else 0.0
        edges = np.linspace(low - room, high + room, BINS + 1)
        axes.hist(x, edges, color=BLUE, alpha=0.75)
        if len(old):
            axes.hist(old, edges, histtype="step", color=INK, linewidth=1.0)
        axes.axvline(float(np.median(x)), color=GREEN, linewidth=1.2)
        tail = 99 if METRICS[name].worse > 0 else 1
        axes.axvline(float(np.percentile(x, tail)), color=RED, linewidth=1.2, linestyle="--")
        axes.set_xlabel(f"{name[: name.rfind('_')].replace('_', ' ')}, {METRICS[name].unit}", fontsize=8)
        axes.set_ylabel("runs", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.locator_params(axis="x", nbins=5)
        _style(axes)
    return figure


def along(name: str, unit: str, labels: Sequence[Any], groups: Sequence[np.ndarray], metric: str) -> Figure:
    """Figure of a metric along an axis: median, band of 5 to 95 % and worst run at each value."""
    figure = _figure(7.2, 2.8)
    axes = figure.subplots()
    numeric = all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in labels)
    x = np.array(labels, float) if numeric else np.arange(len(labels), dtype=float)
    there = [i for i, g in enumerate(groups) if np.isfinite(g).any()]
    there = sorted(there, key=lambda i: x[i])
    clean = [groups[i][np.isfinite(groups[i])] for i in there]
    at = x[there]
    worst = np.max if METRICS[metric].worse > 0 else np.min
    low, middle, high = (np.array([np.percentile(g, q) for g in clean]) for q in (5, 50, 95))
    if numeric:
        axes.fill_between(at, low, high, color=BLUE, alpha=0.2, linewidth=0, label="5 to 95 %")
        axes.plot(at, middle, color=BLUE, linewidth=1.3, marker="o" if len(at) < 40 else None, ms=3, label="median")
    else:
        axes.errorbar(
            at, middle, (middle - low, high - middle), fmt="o", color=BLUE, capsize=4, label="median, 5 to 95 %"
        )
        axes.set_xticks(x, [str(label)[:24] for label in labels], rotation=15 if len(labels) > 4 else 0, fontsize=8)
        axes.set_xlim(-0.5, len(labels) - 0.5)
    axes.plot(at, [worst(g) for g in clean], color=RED, linestyle="none", marker=".", ms=4, label="worst run")
    axes.set_xlabel(f"{name}, {unit}" if unit else name)
    axes.set_ylabel(f"{metric[: metric.rfind('_')].replace('_', ' ')}, {METRICS[metric].unit}")
    axes.legend(loc="best", fontsize=8, frameon=False)
    _style(axes)
    return figure


def png(figure: Figure) -> str:
    """PNG of a figure in base64, for HTML."""
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return base64.b64encode(out.getvalue()).decode()


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), dpi=110, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _style(*panels: Axes) -> None:
    for axes in panels:
        axes.grid(alpha=0.25)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
