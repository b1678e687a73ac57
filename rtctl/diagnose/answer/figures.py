"""Figures of a diagnosis of a described machine, in the style of rtctl/diagnose/answer/figure_style.py."""

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from rtctl.case.start import is_start
from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.figure_style import AFTER, BEFORE, BINS, INK, NOISE, SEEN, label, legend, new, prefixed, thin
from rtctl.diagnose.answer.missing_force import TURN, Missing, subjects
from rtctl.diagnose.answer.phrases import noun
from rtctl.diagnose.answer.posterior import in_words, rivals
from rtctl.diagnose.answer.runner_up import lost_by
from rtctl.diagnose.answer.si_format import figures as digits
from rtctl.diagnose.answer.si_format import percent
from rtctl.diagnose.answer.words import channel_unit, here, value_unit
from rtctl.diagnose.evidence.diagnosis import NOTHING
from rtctl.diagnose.evidence.hats import binned
from rtctl.diagnose.likelihood.widths import Z90

MOST_BARS = 8  # rivals in a figure
MOST_PANELS = 3  # panels in a figure
OWN = 0.85  # of the tolerance interval: least interval of a parameter that the recording does not identify
LEAST_BAR = 1e-4  # probability below which a bar shows its power of ten
PLACES = ("position", "angle")  # axes along which the directions of motion are drawn apart
FINER = 60  # bins along position or angle
ALIKE = 2.0  # over the observer's bandwidth: correlation time of the errors
APART = 0.5  # of the largest value: least difference of the two directions that is drawn


def missing_force(d: GraphDiagnosis) -> Figure:
    """Figure of the missing force along the axis of each effect, binned, with the fitted law."""
    runs, panels = Missing(d), subjects(d)[:MOST_PANELS]
    figure, axes = new(0.4 + 3.0 * len(panels), len(panels), 1)
    for ax, (term, node, axis) in zip(axes, panels, strict=True):
        if axis == "frequency":
            _spectrum(ax, runs, term, node)
        else:
            _curves(ax, d, runs, term, node, axis)
        at = here(runs.machine, node)
        title = f"{noun(term)} at {at}" if term else f"missing at {at}"
        ax.set_title(title, color=INK, fontsize=10, loc="left", pad=22)
        legend(ax, ncols=4, loc="lower left", bbox_to_anchor=(-0.01, 0.98), columnspacing=1.2, handlelength=1.6)
    return figure


def _curves(ax, d: GraphDiagnosis, runs: Missing, term: str, node: str, axis: str) -> None:
    c, rows = runs.of(term, node, axis), runs.rows
    block = max(4, round(ALIKE / runs.fast.follow / d.record.dt))
    parts = {"": np.ones(len(c.x[rows]), bool)}
    bins = BINS
    if axis in PLACES and d.verdict != NOTHING:
        bins = FINER
        forward = runs.speed(node)[rows] > 0.0
        parts |= {", forwards": forward, ", backwards": ~forward}
    found = {
        way: binned(c.x[rows][keep], c.y[rows][keep], c.law[rows][keep], bins, block, np.mean)
        for way, keep in parts.items()
    }
    both = [k for k in found if k] if _differ(found, 3 if term else 1) else [""]
    size = max(float(np.nanmax(np.abs(found[k][1]), initial=0.0)) for k in both)
    law = max(float(np.nanmax(np.abs(found[k][3]), initial=0.0)) for k in both) if term else 0.0
    scale, shown = prefixed(np.array([size]), c.y_unit)
    across, along = prefixed(c.x, c.x_unit) if c.x_unit != "degrees" else (1.0, c.x_unit)
    half = 0.0
    for way, marker, line in zip(both, "o^", ("-", "--"), strict=False):
        middle, m, band, known = found[way]
        ax.fill_between(across * middle, scale * (m - band), scale * (m + band), color=BEFORE, alpha=0.3, lw=0)
        ax.plot(across * middle, scale * m, marker, ms=3.5, color=BEFORE, label=f"missing{way}")
        if term:
            ax.plot(
                across * middle,
                scale * known,
                line,
                color=AFTER,
                lw=1.8,
                label=f"law{way}" if way else "law that was found",
            )
        half = max(half, _middle(band))
    free = d.decided.unlisted
    if not term and d.located is not None and free is not None and axis == free.axis:
        # at the rows only: a knot without rows beside it may have any value
        at = np.sort(np.concatenate([found[k][0][np.isfinite(found[k][0])] for k in both]))
        turn = c.x_unit == "degrees"
        knots = np.degrees(free.knots) if turn else free.knots
        value = np.interp(at, knots, free.value, period=TURN if turn else None)
        ax.plot(across * at, scale * value, color=AFTER, lw=1.5, label="free function that fits best")
    ax.axhline(0, color=SEEN, lw=0.8)
    top = scale * (1.4 * max(size, law) + half)
    ax.set_ylim(-top or -1.0, top or 1.0)
    label(ax, f"{c.x_words}, {along}", f"{c.y_words}, {shown}")


def _differ(found: dict[str, np.ndarray], row: int) -> bool:
    """Whether a row of the curves (4, bins) depends on the direction of motion; the key "" holds both directions."""
    ways = [v[[0, row]][:, np.isfinite(v[0])] for k, v in found.items() if k]
    if len(ways) < 2 or min(v.shape[1] for v in ways) < 2:
        return False
    (x0, y0), (x1, y1) = ways
    gap = np.abs(y0 - np.interp(x0, x1, y1))
    size = max(np.abs(y0).max(), np.abs(y1).max())
    return bool((np.max(gap) if row == 3 else np.median(gap)) > APART * size)


def _middle(half: np.ndarray) -> float:
    good = half[np.isfinite(half)]
    return float(np.median(good)) if len(good) else 0.0


def _spectrum(ax, runs: Missing, term: str, node: str) -> None:
    """Spectrum of the missing force, without the effect and with the effect."""
    c = runs.of(term, node, "time")
    rate = 1.0 / runs.d.record.dt
    y, rest = c.y[runs.rows], (c.y - c.law)[runs.rows]
    size = min(len(y), max(256, round(4 * rate)))
    scale, shown = prefixed(np.array([np.std(y)]), c.y_unit)
    for values, color, text in ((y, BEFORE, "missing without the effect"), (rest, AFTER, "missing with the effect")):
        f, p = welch(values, rate, nperseg=size)
        ax.loglog(f[1:], scale * np.sqrt(p[1:]), color=color, lw=1.0, label=text)
    ax.tick_params(which="both", colors=INK, labelsize=8.5)
    ax.set_xlim(2.0 * rate / size, min(rate / 2, 4 * runs.fast.follow))
    ax.set_xlabel("frequency, Hz")
    ax.set_ylabel(f"{c.y_words}, {shown}/rtHz")


def heldout(d: GraphDiagnosis) -> Figure:
    """Figure of the held-out residual of each sensor, in units of its noise, before and after; the motion on top."""
    late = d.heldout.late.parts[0]
    sim, record = late.sim, late.sim.record
    names = sim.channels
    first = "before" if d.decided.best.names else "fitted description"
    models = [(first, d.heldout.models[0], BEFORE), ("after", d.heldout.models[1], AFTER)]
    models = models[: 2 if d.heldout.models[1].terms != d.heldout.models[0].terms else 1]
    residuals = [(text, late.raw(m) / (late.least * np.sqrt(late.mean)), color) for text, m, color in models]
    order = np.argsort(-np.max([np.sqrt(np.mean(e**2, axis=0)) for _, e, _ in residuals], axis=0))[:MOST_PANELS]
    figure, axes = new(1.5 + 1.6 * len(order), 1 + len(order), 1, sharex=True)
    rows = slice(late.rows[0], late.rows[1])
    scale, unit = prefixed(sim.seen[rows], _unit(d, sim.main))
    axes[0].plot(*thin(record.t[rows] - record.t[0], scale * sim.seen[rows]), color=SEEN, lw=1.6)
    label(axes[0], "", unit, f"Recorded by {here(record.case.machine, sim.main)}")
    t = (late.rows[0] + late.mean * np.arange(len(residuals[0][1]))) * record.dt
    for ax, c in zip(axes[1:], order, strict=True):
        worst = 3.0
        for text, e, color in residuals:
            rms = float(np.sqrt(np.mean(e[:, c] ** 2)))
            ax.plot(*thin(t, e[:, c]), color=color, lw=0.9, label=f"{text}: {digits(rms, 2)} rms")
            worst = max(worst, float(np.abs(e[:, c]).max()))
        ax.axhspan(-2, 2, color=NOISE, alpha=0.3, lw=0)
        ax.set_ylim(-1.1 * worst, 1.1 * worst)
        label(ax, "", "residual / noise", f"Residual of {here(record.case.machine, names[c])}")
        legend(ax, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 0.97))
    axes[-1].set_xlabel("time, s", color=INK, fontsize=9.5)
    return figure


def _unit(d: GraphDiagnosis, sensor: str) -> str:
    return channel_unit(d.record.case.machine, sensor)


def posterior(d: GraphDiagnosis) -> Figure:
    """Figure of the posterior of the combinations of effects, the nominal model alone, and unnamed effects."""
    bars = rivals(d)[:MOST_BARS]
    figure, (ax,) = new(0.8 + 0.33 * len(bars))
    for row, bar in enumerate(bars):
        ax.barh(row, 100 * bar.probability, color=BEFORE if bar.free else AFTER, height=0.6)
        text = percent(bar.probability) if bar.probability > LEAST_BAR else f"1e{bar.behind / np.log(10.0):.0f}"
        ax.text(100 * bar.probability + 1.0, row, text, va="center", fontsize=8.5, color=INK)
    ax.set_yticks(range(len(bars)), [_folded(in_words(d, bar)) for bar in bars])
    ax.tick_params(axis="y", labelsize=8.5)
    ax.invert_yaxis()
    ax.set_xlim(0, 118)
    ax.set_xticks(range(0, 101, 20))
    ax.grid(axis="y", visible=False)
    label(ax, "probability, %")
    return figure


def runner_up(d: GraphDiagnosis) -> Figure | None:
    """Figure of the gain in nats of the answer over the next likeliest one in each part of the recording; None where
    all gains are zero."""
    lost = lost_by(d)
    if lost is None or not lost.nats.any():
        return None
    figure, (ax,) = new(2.2)
    colors = np.where(lost.nats > 0.0, AFTER, BEFORE)
    ax.bar(lost.edges[:-1], lost.nats, np.diff(lost.edges), align="edge", color=colors, edgecolor="none")
    ax.axhline(0, color=SEEN, lw=0.8)
    ax.set_xlim(lost.edges[0], lost.edges[-1])
    label(ax, "time, s" if len(d.records) == 1 else "share of the rows of all recordings", "gain of the answer, nats")
    return figure


def _folded(text: str, most: int = 44) -> str:
    """Text, a long one broken at the space next to its middle."""
    if len(text) <= most:
        return text
    gaps = [i for i, sign in enumerate(text) if sign == " "]
    middle = min(gaps, key=lambda i: abs(i - len(text) // 2))
    return f"{text[:middle]}\n{text[middle + 1 :]}"


def parameters(d: GraphDiagnosis) -> Figure | None:
    """Figure of the fitted over the nominal numbers with 90 % intervals; grey where the interval is the tolerance."""
    names = [path for path in d.parameters if not is_start(path)]
    if not names:
        return None
    space, owner = d.found.base.space, d.nominal
    figure, (ax,) = new(0.9 + 0.24 * len(names))
    for row, name in enumerate(names):
        v, nominal = d.parameters[name], owner[name]
        tolerance = 100 * space.tolerance(path_of(d, name))
        if np.isfinite(tolerance):
            ax.barh(row, 2 * tolerance, left=-tolerance, color=SEEN, alpha=0.25, height=0.8)
        value, low, high = (100 * (x / nominal - 1) for x in (v.value, v.low, v.high))
        ends = [[max(value - min(low, high), 0)], [max(max(low, high) - value, 0)]]
        ax.errorbar(value, row, xerr=ends, fmt="o", ms=4, color=SEEN if untold(d, name) else AFTER, capsize=3)
    ax.axvline(0, color=INK, lw=0.8)
    ax.set_yticks(range(len(names)), names)
    ax.tick_params(axis="y", labelsize=8.5)
    ax.invert_yaxis()
    label(ax, "deviation from nominal, %; grey band: tolerance")
    return figure


def path_of(d: GraphDiagnosis, name: str) -> str:
    """Path of a fitted number by its symbol or path."""
    called = d.record.case.called
    return next(path for path in d.found.base.space.names if called.get(path, path) == name)


def untold(d: GraphDiagnosis, name: str) -> bool:
    """Whether the interval of a fitted number is its tolerance: the recording does not identify the number."""
    space = d.predictor.space
    weight = float(space.prior()[space.names.index(path_of(d, name))])
    v = d.parameters[name]
    if weight <= 0.0 or v.value == 0.0:
        return False
    ends = np.abs(np.log((v.low / v.value, v.high / v.value))) if v.low * v.high > 0 else np.inf
    half = float(np.max(ends))  # the bound of the tolerance may cut off one end
    return half > OWN * Z90 / np.sqrt(weight)


__all__ = ["heldout", "missing_force", "parameters", "posterior", "runner_up", "untold", "value_unit"]
