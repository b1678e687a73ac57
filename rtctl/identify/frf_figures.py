"""Figures of frequency responses: sensitivity with coherence, best linear approximation with levels, model fit."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.identify.best_linear import BestLinear
from rtctl.identify.frf import Frf
from rtctl.identify.model_fit import Fit
from rtctl.identify.sensitivity import Sensitivity
from rtctl.machines.profile import REELS
from rtctl.machines.profiles import profile_of
from rtctl.trace.plot import BLUE, GREEN, GREY, INK, ORANGE, RED


def sensitivity(result: Sensitivity, model: np.ndarray | None = None) -> Figure:
    """Figures 8.2 and 12.5: |S|, its phase, coherence, and |H_p| with its 95 % band. `model` (n,) is S of a model."""
    figure, axes = _panels(4, "Sensitivity at constant speed", heights=(2, 1, 1, 2))
    above, turn, coherence, process = axes
    above.semilogx(result.f, _db(result.S), color=BLUE, linewidth=1.1, label=f"measured, {result.averages} averages")
    turn.semilogx(result.f, np.degrees(np.angle(result.S)), color=BLUE, linewidth=1.1)
    if model is not None:
        above.semilogx(result.f, _db(model), "--", color=INK, linewidth=1.0, label="model")
        turn.semilogx(result.f, np.degrees(np.angle(model)), "--", color=INK, linewidth=1.0)
    coherence.semilogx(result.f, result.coherence, color=GREEN, linewidth=1.1)
    coherence.set_ylim(0.0, 1.05)
    _magnitude(process, result.frf, "H_p")
    for one, words in zip(axes, ("|S| [dB]", "phase of S [deg]", "coherence", _words(result.frf)), strict=True):
        one.set_ylabel(words)
    _legends(above, process)
    return figure


def best_linear(result: BestLinear) -> Figure:
    """Figure of a response with its noise and distortion levels, and its phase."""
    figure, (above, turn) = _panels(2, "Best linear approximation", heights=(2.4, 1))
    above.semilogx(result.f, _db(result.G), ".", color=BLUE, markersize=4, label="response")
    for level, color, words in (
        (result.total, RED, "deviation, noise and distortion"),
        (result.noise, GREY, "deviation, noise"),
        (result.odd, ORANGE, "odd distortion"),
    ):
        above.semilogx(result.f, _db(level), color=color, linewidth=1.0, label=words)
    above.semilogx(result.f_even, _db(result.even), color=GREEN, linewidth=1.0, label="even distortion")
    turn.semilogx(result.f, _unwrapped(result.G), ".", color=BLUE, markersize=4)
    above.set_ylabel(_words(result.frf))
    turn.set_ylabel("phase [deg]")
    _legends(above)
    return figure


def model_fit(result: Fit) -> Figure:
    """Figure 8.3: measured and fitted response, magnitude and phase, one colour for each response."""
    figure, (above, turn, off) = _panels(3, "Model fit", heights=(2.2, 1.6, 1))
    for i, (frf, model) in enumerate(zip(result.frfs, result.models, strict=True)):
        color = (BLUE, ORANGE, GREEN, RED)[i % 4]
        radii = f"motor {frf.motor}, {1e3 * frf.R1:.1f}/{1e3 * frf.R2:.1f} mm"
        label = radii if profile_of(frf.kind).has(REELS) else "measured"
        _magnitude(above, frf, label, color)
        above.semilogx(frf.f, _db(model), "--", color=INK, linewidth=1.0, label="model" if i == 0 else None)
        phase = _unwrapped(model)
        turn.semilogx(frf.f, phase + np.degrees(np.angle(frf.H / model)), ".", color=color, markersize=3)
        turn.semilogx(frf.f, phase, "--", color=INK, linewidth=1.0)
        off.semilogx(frf.f, np.abs(frf.H / model - 1) / frf.relative, ".", color=color, markersize=3)
    above.set_ylabel(_words(result.frfs[0]))
    turn.set_ylabel("phase [deg]")
    off.set_ylabel("misfit / deviation")
    _legends(above)
    return figure


def _panels(count: int, title: str, heights: tuple[float, ...]) -> tuple[Figure, Any]:
    figure = Figure(figsize=(10, 1.0 + 1.5 * sum(heights)), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(count, 1, sharex=True, height_ratios=list(heights))
    for one in axes:
        one.grid(True, which="both", color="#e3e5e8", linewidth=0.6)
        one.set_axisbelow(True)
        one.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("frequency [Hz]")
    figure.suptitle(title, x=0.01, ha="left", fontsize=14, fontweight="bold")
    return figure, axes


def _magnitude(axes: Axes, frf: Frf, label: str, color: str = BLUE) -> None:
    low, high = frf.band()
    floor = np.maximum(low, 0.1 * np.abs(frf.H))  # 0 has no value in dB
    axes.fill_between(frf.f, _db(floor), _db(high), color=color, alpha=0.25, linewidth=0)
    axes.semilogx(frf.f, _db(frf.H), ".", color=color, markersize=3, label=label)


def _unwrapped(H: np.ndarray) -> np.ndarray:
    """Unwrapped phase in degrees; it begins between -360 and 0: a mass begins at -180."""
    phase = np.degrees(np.unwrap(np.angle(H)))
    return phase - 360.0 * np.ceil(phase[0] / 360.0)


def _db(x: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        size = 20 * np.log10(np.abs(x))
    return np.where(np.isfinite(size), size, np.nan)


def _words(frf: Frf) -> str:
    return f"|H| [dB, {profile_of(frf.kind).unit}/{'A' if frf.per_ampere else 'V'}]"


def _legends(*axes: Axes) -> None:
    for one in axes:
        one.legend(loc="best", fontsize=9, frameon=False)
