"""Plot of the latency histograms: a panel for each rate, rtctl's loop and cyclictest on common axes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.doctor.measure import Lateness, Measured, Rate, edges, words
from rtctl.doctor.report import figures
from rtctl.trace.plot import BLUE, GREY, ORANGE, RED, save

COARSE = 4  # buckets of the histogram that are drawn as one
LINES = {"p50": ":", "p99": "-.", "p999": "--", "max": "-"}


def plot(measured: Measured, path: Path, title: str) -> None:
    """Draw the histograms into a PNG. Raises UserError where it cannot be written."""
    figure = Figure(figsize=(11, 1.0 + 3.4 * len(measured.rates)), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(measured.rates), 1, sharex=True, squeeze=False)[:, 0]
    for axes, rate in zip(panels, measured.rates, strict=True):
        _panel(axes, rate)
    panels[-1].set_xlim(*_ends(measured.rates))
    panels[-1].set_xlabel("lateness of a wake-up [us]; lines: p50 dotted, p99 dash-dotted, p99.9 dashed, max solid")
    figure.suptitle(title, x=0.01, ha="left", fontsize=14, fontweight="bold")
    save(figure, path)


def _panel(axes: Axes, rate: Rate) -> None:
    drawn = [("rtctl", rate.ours, BLUE)]
    if rate.cyclictest is not None:
        drawn.append(("cyclictest", rate.cyclictest, ORANGE))
    for name, h, colour in drawn:
        starts, count = coarse(h)
        axes.stairs(count, starts / 1000, color=colour, fill=True, alpha=0.25)
        axes.stairs(count, starts / 1000, color=colour, linewidth=1.2, label=f"{name}: {figures(h)}")
        for k, style in LINES.items():
            axes.axvline(h.us[k], color=colour, linewidth=1.0, linestyle=style)
    half = 5e5 / rate.hz
    axes.axvspan(half, 1e9, color=RED, alpha=0.07, linewidth=0)
    axes.text(half, 0.98, " half a period", transform=axes.get_xaxis_transform(), color=RED, va="top", fontsize=9)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.7)
    axes.set_ylabel("wake-ups")
    axes.set_title(words(rate.hz), loc="left", fontsize=11, fontweight="bold")
    axes.grid(True, color="#e3e5e8", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GREY)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=9, borderaxespad=0.1)


def _ends(rates: Sequence[Rate]) -> tuple[float, float]:
    """Ends of the common axis in us: they enclose all counts and half of each period."""
    every = [h for rate in rates for h in (rate.ours, rate.cyclictest) if h is not None]
    first = min(float(edges()[np.flatnonzero(h.record["bucket"])[0]]) for h in every)
    last = max(*(h.us["max"] for h in every), *(5e5 / rate.hz for rate in rates))
    return max(first, 100.0) / 1500, 2.0 * last


def coarse(h: Lateness) -> tuple[np.ndarray, np.ndarray]:
    """Edges in ns, (n + 1,), and counts, (n,), of buckets joined by `COARSE`."""
    count = h.record["bucket"].reshape(-1, COARSE).sum(axis=1)
    starts = edges()[::COARSE].astype(float)
    return np.append(starts, 2 * starts[-1]), count
