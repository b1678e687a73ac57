from pathlib import Path

import numpy as np

from rtctl.diagnose.answer import figure_style as figures
from rtctl.plants.physics import TERMS

PRACTICE = Path(__file__).resolve().parents[4] / "shared" / "blind" / "practice"
ALIKE = ("friction.stribeck", "friction.coulomb")
STICKS = TERMS["friction.stribeck"].settings(node="carriage", F_s=2.0, v_s=0.3)
CASE = {
    "format": 1, "plant": "axis", "sample_rate": 500.0, "parameters": {"M": 2.0, "F_v": 4.0, "F_c": 1.0},
    "drive": {"newton_per_volt": 10.0, "limit_volt": 10.0}, "sensors": {"x_resolution_m": 1e-6}, "delay_samples": 0.0,
    "controller": {"kind": "none"}, "controller_known": False, "reaches": {"parameter_tolerance": 0.15},
}  # fmt: skip


def texts(figure):
    """All texts of a figure."""
    return " | ".join(t.get_text() for t in figure.findobj(lambda a: hasattr(a, "get_text")) if t.get_text())


def visible(figure):
    """Bounding boxes of the drawn texts."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    out = []
    for ax in figure.axes:
        if ax.name == "polar":
            continue
        slanted = any(t.get_rotation() for t in ax.get_xticklabels())  # boxes of slanted texts always overlap
        ticks = []
        for along, axis in ((0, ax.xaxis), (1, ax.yaxis)):
            low, high = sorted(axis.get_view_interval())
            shown = [t for t in axis.get_ticklabels() if t.get_text() and low <= t.get_position()[along] <= high]
            ticks += shown if along or not slanted else []
        named = [ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label, *ticks]
        out += [(t.get_text(), t.get_window_extent(renderer)) for t in named if t.get_text()]
        if ax.get_legend() is not None:
            out.append(("legend", ax.get_legend().get_window_extent(renderer)))
    return out


def test_thinning_keeps_peaks():
    y = np.zeros(100_000)
    y[51_234] = 7.0
    t, thinned = figures.thin(np.arange(len(y)), y)
    assert len(t) == len(thinned) < 3 * figures.POINTS and thinned.max() == 7.0
