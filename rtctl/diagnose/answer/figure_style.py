"""Style of the figures of a diagnosis: colours, panels, labels, thinning and SI prefixes.

The report replaces INK by the text colour of the page: a figure is legible on a light and on a dark page. All other
colours have a middle lightness for legibility on both.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.diagnose.answer import phrases as words

INK, BEFORE, AFTER, SEEN, NOISE = "#1d1d1f", "#d9730d", "#1f83d6", "#84898f", "#84898f"
POINTS = 1200  # points of a curve, about the pixels of a panel's width
BINS = 36  # bins of a curve of the missing force
WIDTH = 7.2  # inches


def new(height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, np.ndarray]:
    """Figure without a background, and its panels as an array (rows * columns,) of Axes."""
    figure = Figure((WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    figure.patch.set_alpha(0.0)
    axes = figure.subplots(rows, columns, squeeze=False, **options).ravel()
    for ax in axes:
        style(ax)
    return figure, axes


def style(ax: Axes) -> None:
    """Style a panel: text in INK, no background, a faint grid."""
    ax.set_facecolor("none")
    ax.tick_params(colors=INK, labelsize=9)
    for name, spine in ax.spines.items():
        spine.set(color=SEEN, linewidth=0.8)
        if name in ("top", "right"):
            spine.set_visible(False)
    ax.grid(color=SEEN, alpha=0.25, linewidth=0.6)
    ax.set_axisbelow(True)


def label(ax: Axes, x: str = "", y: str = "", title: str = "") -> None:
    """Label the axes of a panel, and set its title."""
    ax.set_xlabel(x, color=INK, fontsize=9.5)
    ax.set_ylabel(y, color=INK, fontsize=9.5)
    if title:
        ax.set_title(title, color=INK, fontsize=10, loc="left")


def legend(ax: Axes, **options: Any) -> None:
    """Draw the legend of a panel with labelled curves."""
    if ax.get_legend_handles_labels()[0]:
        ax.legend(**{"fontsize": 8.5, "frameon": False, "labelcolor": INK, **options})


def thin(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Thinned curve: lowest and highest value of each bucket, so that no peak is lost."""
    step = len(y) // POINTS
    if step < 3:
        return t, y
    keep = len(y) // step * step
    parts = y[:keep].reshape(-1, step)
    return np.repeat(t[:keep:step], 2), np.stack([parts.min(axis=1), parts.max(axis=1)], axis=1).ravel()


def prefixed(values: np.ndarray, unit: str) -> tuple[float, str]:
    """Factor and unit that make the largest of the values a readable number."""
    power = min(words.prefix(float(np.nanmax(np.abs(values), initial=0.0)), unit), 0)
    return 10.0**-power, words.PREFIXES[power] + unit
