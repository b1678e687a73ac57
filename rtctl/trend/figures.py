"""Pictures of a trend: the estimates of each number over time with their intervals, changes marked."""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.diagnose.answer.figure_style import AFTER, BEFORE, INK, SEEN, label, new
from rtctl.trend.change_points import SHIFT
from rtctl.trend.series import Judged

HEIGHT = 1.7  # inches of a panel
BARS = 400  # estimates with an interval drawn; of more the band is drawn


def panels(judged: Sequence[Judged], least: float) -> Figure:
    """A panel for each series of one machine, over the same time."""
    figure, axes = new(HEIGHT * len(judged) + 0.4, len(judged), 1, sharex=True)
    for ax, one in zip(axes, judged, strict=True):
        _panel(ax, one, least)
    axes[-1].set_xlabel("time" if judged[0].series.dated else "recording, by name", color=INK, fontsize=9.5)
    return figure


def _panel(ax: Axes, one: Judged, least: float) -> None:
    series = one.series
    value = np.array([row["value"] for row in series.rows])
    low, high = (np.array([row[end] for row in series.rows]) for end in ("low", "high"))
    x = np.array([datetime.fromtimestamp(at, UTC) for at in series.at]) if series.dated else series.at
    if len(value) <= BARS:
        ax.vlines(x, low, high, color=SEEN, alpha=0.6, linewidth=0.9)
    else:
        ax.fill_between(x, low, high, color=SEEN, alpha=0.3, linewidth=0)
    ax.plot(x, value, ".", color=AFTER, markersize=3.5 if len(value) <= BARS else 1.5)
    nominal = series.rows[-1]["nominal"]
    if nominal is not None and series.kind == "parameter" and low.min() <= nominal <= high.max():
        ax.axhline(nominal, color=SEEN, linewidth=0.9, linestyle=(0, (4, 3)))
    _fitted(ax, one, x, value)
    for change in one.changes:
        if change.kind != SHIFT:
            continue
        colour = BEFORE if one.alarms(change, least) else SEEN
        ax.axvspan(x[max(change.earliest - 1, 0)], x[change.latest], color=colour, alpha=0.18, linewidth=0)
        ax.axvline(x[change.first], color=colour, linewidth=1.2)
    ax.margins(x=0.01)
    ax.ticklabel_format(axis="y", useOffset=False)
    ax.yaxis.get_offset_text().set(color=INK, fontsize=8, x=-0.08)
    unit = f", {series.unit}" if series.unit else ""
    what = series.name if series.kind == "parameter" else f"residual of {series.name}"
    label(ax, title=f"{what}{unit}")
    ax.tick_params(axis="x", labelrotation=0, labelsize=8)


def _fitted(ax: Axes, one: Judged, x: np.ndarray, value: np.ndarray) -> None:
    """The level between changes: medians, and the line of a drift."""
    shifts = sorted(change.first for change in one.changes if change.kind == SHIFT)
    if len(shifts) < len(one.changes):
        drift = next(change for change in one.changes if change.kind != SHIFT)
        place = (one.series.at - one.series.at[0]) / np.ptp(one.series.at) - 0.5
        ax.plot(x, np.median(value) * np.exp(drift.size * place), color=BEFORE, linewidth=1.2)
        return
    ends = [0, *shifts, len(value)]
    for begin, end in pairwise(ends):
        if shifts:
            ax.plot(x[[begin, end - 1]], [np.median(value[begin:end])] * 2, color=INK, linewidth=1.0)
