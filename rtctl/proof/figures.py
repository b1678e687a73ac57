"""Figures of the scores: reliability diagram of the confidence, and confusion matrix."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rtctl.config.files import replaced
from rtctl.proof.score import NOTHING_MISSING, wilson

Json = dict[str, Any]
INK, LIGHT = "#1f4e79", "#888888"
REST = ("ambiguous", "unnamed", "nothing", "missing")  # answers without a single name, last among the columns


def reliability(R: Json, path: Path) -> None:
    """Reliability diagram: share of right names over their confidence, with 95 % intervals (Wilson) and counts."""
    bins = R["calibration"]["table"]
    figure = Figure(figsize=(5.2, 4.4), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=LIGHT, linewidth=0.8, linestyle="--", label="as good as it says")
    for b in bins:
        ends = np.array(wilson(b["right"] * b["names"], b["names"]), float)
        axes.plot([b["confidence"]] * 2, ends, color=INK, linewidth=1.2)
        axes.plot(b["confidence"], b["right"], "o", color=INK)
        axes.annotate(f" {b['names']}", (b["confidence"], b["right"]), fontsize=8, ha="left", va="top")
    axes.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="confidence given to a name", ylabel="share of names that were right",
             title=f"Reliability of {R['calibration']['names']} names")  # fmt: skip
    axes.legend(loc="upper left", frameon=False, fontsize=8)
    with replaced(path, "wb") as file:
        figure.savefig(file, format="png", dpi=110)


def confusion(R: Json, path: Path) -> None:
    """Confusion matrix of cases with one effect or none; a cell has the number of cases, its shade the row share."""
    truths = [t for t in R["confusion"] if "+" not in t]
    truths.sort(key=lambda t: (t == "unknown", t in NOTHING_MISSING, t))
    given = {answer for t in truths for answer in R["confusion"][t]}
    answers = sorted({t for t in truths if t in given} | (given - {*REST})) + [a for a in REST if a in given]
    cases = np.array([[R["confusion"][t].get(a, 0) for a in answers] for t in truths], float)
    shares = cases / np.maximum(cases.sum(1, keepdims=True), 1)
    figure = Figure(figsize=(1.8 + 0.3 * len(answers), 1.6 + 0.24 * len(truths)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1.3, aspect="auto")
    for i, j in np.argwhere(cases > 0):
        axes.text(j, i, f"{cases[i, j]:.0f}", ha="center", va="center", fontsize=7)
        if answers[j] == truths[i] or (answers[j], truths[i]) in (("nothing", t) for t in NOTHING_MISSING):
            axes.add_patch(_frame(i, j))
    axes.set_xticks(range(len(answers)), answers, rotation=90, fontsize=7)
    axes.set_yticks(range(len(truths)), truths, fontsize=7)
    axes.set(xlabel="answer", ylabel="truth")
    with replaced(path, "wb") as file:
        figure.savefig(file, format="png", dpi=110)


def _frame(i: int, j: int) -> Any:
    """Frame around the cell of a right answer."""
    from matplotlib.patches import Rectangle

    return Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, edgecolor=INK, linewidth=1.2)
