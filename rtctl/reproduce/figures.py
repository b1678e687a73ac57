"""Common functions of the figures: axes, colours and export."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from rtctl.config.files import replaced
from rtctl.trace.plot import BLUE, GREEN, GREY, INK, ORANGE, RED, envelope

__all__ = [
    "BLUE", "COLORS", "GREEN", "GREY", "INK", "ORANGE", "RED",
    "db", "degrees", "legend", "line", "loop", "panels", "save", "title",
]  # fmt: skip

COLORS = (BLUE, ORANGE, GREEN, RED)
DOTS = 100  # dots per inch
PALETTE = 48  # colours


def panels(
    rows: int, columns: int = 1, height: float = 2.0, width: float = 7.2, sharex: Any = False
) -> tuple[Figure, list[Axes]]:
    """A figure with `rows` times `columns` axes, each `height` inches high, row by row."""
    figure = Figure(figsize=(width, 0.4 + rows * height), dpi=DOTS, layout="constrained")
    FigureCanvasAgg(figure)
    every = list(figure.subplots(rows, columns, squeeze=False, sharex=sharex).flat)
    for axes in every:
        axes.grid(True, color="#e3e5e8", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
        axes.xaxis.label.set_size(9)
        axes.yaxis.label.set_size(9)
    return figure, every


def line(axes: Axes, x: Any, y: Any, color: str = BLUE, style: str = "-", **more: Any) -> None:
    """Draw a line of any number of points by its visible points."""
    x, y = envelope(np.asarray(x, float), np.asarray(y, float), 600)
    axes.plot(x, y, style, color=color, **{"linewidth": 1.1, **more})


def title(axes: Axes, words: str) -> None:
    """Title above the axes, left-aligned."""
    axes.set_title(words, loc="left", fontsize=9)


def legend(axes: Axes, **more: Any) -> None:
    """A legend without a frame."""
    axes.legend(**{"frameon": False, "fontsize": 8, **more})


def loop(axes: Sequence[Axes], f: np.ndarray, L: np.ndarray, share: Any, color: str, style: str, words: str) -> None:
    """Draw |L|, |T| = share |L / (1 + L)| and |S| of a loop (n,) at `f` (n,) in Hz on three axes; `words` label it."""
    opened, closed, S = axes
    opened.semilogx(f, db(L), style, color=color, linewidth=1.0, label=words)
    closed.semilogx(f, db(share * L / (1 + L)), style, color=color, linewidth=1.0)
    S.semilogx(f, db(1 / (1 + L)), style, color=color, linewidth=1.0)


def db(x: Any) -> np.ndarray:
    """Magnitude in dB."""
    return np.asarray(20 * np.log10(np.maximum(np.abs(x), 1e-30)))


def degrees(x: Any) -> np.ndarray:
    """Unwrapped phase in degrees; it starts between -360 and 0: a mass starts at -180."""
    phase = np.degrees(np.unwrap(np.angle(x)))
    return np.asarray(phase - 360 * np.round((phase[0] + 180) / 360))


def save(figure: Figure, folder: Path, number: str) -> Path:
    """Save a figure as a small PNG, `figure_8_3.png` for number 8.3; returns its path."""
    buffer = BytesIO()
    figure.savefig(buffer)
    path = folder / f"figure_{number.replace('.', '_')}.png"
    with Image.open(buffer) as image, replaced(path, "wb") as file:  # a small palette halves the bytes
        image.convert("RGB").quantize(PALETTE).save(file, format="png", optimize=True)
    return path
