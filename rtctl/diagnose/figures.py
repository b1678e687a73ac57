"""Pictures of a diagnosis. Each function takes the diagnosis and its simulator and returns a matplotlib Figure.

INK stands for the colour of the text around a figure: the report puts the page's own colour in its place, so that a
figure reads on light and on dark paper. All other colours are of middle lightness for the same reason.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter1d
from scipy.signal import welch
from scipy.stats import chi2

from rtctl.diagnose import turn, words
from rtctl.diagnose.diagnosis import Diagnosis
from rtctl.diagnose.heldout import mode_of, readings
from rtctl.diagnose.hints import ORDERS, spectrum
from rtctl.diagnose.kernel import CLOSED, OPEN, TRACK
from rtctl.diagnose.missing import BLOCK, Missing, binned, observe
from rtctl.diagnose.model import FITTED, Model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.scales import speed
from rtctl.diagnose.simulate import Simulator
from rtctl.plants import physics
from rtctl.plants.physics import TERMS

INK, BEFORE, AFTER, SEEN, NOISE = "#1d1d1f", "#d9730d", "#1f83d6", "#84898f", "#84898f"
POINTS = 1200  # about the pixels of a panel's width
BINS = 36
WIDTH = 7.2  # inches
MOST_BARS = 18
RUNS = {
    CLOSED: "free run, loop closed by the machine's own law", TRACK: "on the recorded track",
    OPEN: "free run from the recorded command",
}  # fmt: skip


def new(height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, np.ndarray]:
    """A figure without a background and its panels, as an array of Axes."""
    figure = Figure((WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    figure.patch.set_alpha(0.0)
    axes = figure.subplots(rows, columns, squeeze=False, **options).ravel()
    for ax in axes:
        style(ax)
    return figure, axes


def style(ax: Axes) -> None:
    """Ink on nothing, with a faint grid."""
    ax.set_facecolor("none")
    ax.tick_params(colors=INK, labelsize=9)
    for name, spine in ax.spines.items():
        spine.set(color=SEEN, linewidth=0.8)
        if name in ("top", "right"):
            spine.set_visible(False)
    ax.grid(color=SEEN, alpha=0.25, linewidth=0.6)
    ax.set_axisbelow(True)


def label(ax: Axes, x: str = "", y: str = "", title: str = "") -> None:
    """Words on a panel."""
    ax.set_xlabel(x, color=INK, fontsize=9.5)
    ax.set_ylabel(y, color=INK, fontsize=9.5)
    if title:
        ax.set_title(title, color=INK, fontsize=10, loc="left")


def legend(ax: Axes, **options: Any) -> None:
    """Its legend, where there is something to name; above the panel, so that it hides nothing."""
    if ax.get_legend_handles_labels()[0]:
        ax.legend(**{"fontsize": 8.5, "frameon": False, "labelcolor": INK, **options})


def thin(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest of each bucket, so that no peak is lost."""
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


def heldout_rows(d: Diagnosis) -> slice:
    """Rows that no fit saw; the last quarter where all were fitted."""
    n = len(d.record.t)
    return slice(d.fit_rows[1], n) if d.fit_rows[1] < n - 10 else slice(n - n // 4, n)


def stages(d: Diagnosis) -> list[tuple[str, Model, str]]:
    """The models to show, with their names and colours."""
    return [("before", d.before, BEFORE), ("after", d.after, AFTER)][: 2 if d.after.terms else 1]


def heldout_overlay(d: Diagnosis, sim: Simulator) -> Figure:
    """Main channel on rows that no fit saw, recorded and simulated before and after, and the errors below."""
    rows, mode = heldout_rows(d), TRACK if d.on_track else mode_of(d.record)
    t, unit = d.record.t[rows], words.main_unit(d)
    figure, (top, low) = new(4.6, 2, 1, sharex=True, height_ratios=(1.15, 1))
    top.plot(*thin(t, sim.seen[rows]), color=SEEN, lw=2.6, label="recorded")
    noise = words.heldout_error(d, d.noise_floor)
    models = stages(d)
    worst = 0.0
    for name, model, color in models:
        out = readings(sim, model, rows, mode)[rows, 0]
        e = sim.seen[rows] - out
        rms = float(np.sqrt(np.mean(e**2)))
        top.plot(*thin(t, out), color=color, lw=1.0, label=f"{name}", ls="--" if name == "before" else "-")
        low.plot(*thin(t, e), color=color, lw=0.9, label=f"{name}: {words.nice(rms, unit)} rms")
        worst = max(worst, float(np.nanmax(np.abs(e), initial=0.0)))
    low.axhspan(-2 * noise, 2 * noise, color=NOISE, alpha=0.3, lw=0, label=f"noise, +-{words.nice(2 * noise, unit)}")
    low.set_ylim(-1.1 * max(worst, 3 * noise), 1.1 * max(worst, 3 * noise))
    label(top, "", f"{sim.channels[0].removesuffix('_counts')}, {unit}", f"Not fitted: {RUNS[mode]}")
    label(low, "time, s", f"error, {unit}")
    legend(top, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.99))
    legend(low, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.99))
    top.set_title(top.get_title(loc="left"), color=INK, fontsize=10, loc="left", pad=20)
    return figure


def subjects(d: Diagnosis) -> list[tuple[str, str, str]]:
    """Term, node and axis to draw, at most three: the effects, or the place where the error lives, or the main node."""
    modelled = {(t.term, t.node) for t in d.after.terms}  # type: ignore[attr-defined]
    drawn = [e for e in d.effects if e.name in TERMS and (not modelled or (e.name, e.node) in modelled)]
    found = [(e.name, e.node, TERMS[e.name].axis) for e in drawn]
    if not found and d.located is not None:
        found = [("", d.located.node, d.located.axis)]
    main = {"ivu": "capstan", "ldu": "motor", "axis": "carriage"}[d.record.plant]
    found = found or [("", main, "velocity"), ("", main, "position")]
    return [(t, n, "time" if axis == "frequency" else axis) for t, n, axis in list(dict.fromkeys(found))[:3]]


def missing_force(d: Diagnosis, sim: Simulator) -> Figure:
    """What the model lacked against the axis where it lives, binned, with the law that was found on top."""
    map_, panels = Missing(d, sim), subjects(d)
    figure, axes = new(0.4 + 2.9 * len(panels), len(panels), 1)
    for ax, (name, node, axis) in zip(axes, panels, strict=True):
        y, law, unit, what = map_.of(name, node)
        x, along, x_unit = map_.abscissa(axis, node)
        y_unit = _curve(ax, d, x[map_.rows], y[map_.rows], law[map_.rows], unit)
        scale, shown = prefixed(x, x_unit) if along != "angle" else (1.0, x_unit)
        ax.xaxis.set_major_formatter(lambda v, _, s=scale: f"{v * s:.4g}")
        if name in TERMS and TERMS[name].falls_to:
            near = 8 * words.Sizes(name, node, {}, d.after).value("v_s")
            if np.isfinite(near):
                ax.set_xlim(*np.clip((-near, near), *ax.get_xlim()))
        at = words.node_words(node, d.owner.units)
        title = f"{words.noun(name)} at {at}" if name else f"what is left at {at}"
        label(ax, f"{along} of {at}, {shown}" if along != "time" else "time, s", f"{what}, {y_unit}", title)
        legend(ax, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 0.98))
    return figure


def _curve(ax: Axes, d: Diagnosis, x: np.ndarray, y: np.ndarray, law: np.ndarray, unit: str) -> str:
    middle, m, half, known = binned(x, y, law, BINS, max(4, round(BLOCK / d.record.dt)))
    scale, shown = prefixed(np.abs(m), unit)
    ax.fill_between(middle, scale * (m - half), scale * (m + half), color=BEFORE, alpha=0.3, lw=0, label="95 % band")
    ax.plot(middle, scale * m, "o", ms=3, color=BEFORE, label="missing before, median")
    if d.after.terms:
        ax.plot(middle, scale * known, color=AFTER, lw=1.8, label="the law that was found")
    ax.axhline(0, color=SEEN, lw=0.8)
    top = scale * (1.5 * float(np.nanmax(np.abs(m), initial=0.0)) + float(np.nanmedian(half)))
    ax.set_ylim(-top or -1.0, top or 1.0)
    return shown


def polar_map(d: Diagnosis, sim: Simulator) -> Figure | None:
    """The same around the turn, for effects that repeat with an angle; None where there are none."""
    panels = [(n, node) for n, node, axis in subjects(d) if axis == "angle"]
    if not panels or (d.record.plant == "axis" and not d.owner.units.rotary):
        return None
    map_ = Missing(d, sim)
    figure, axes = new(4.2, 1, len(panels), subplot_kw={"projection": "polar"})
    for ax, (name, node) in zip(axes, panels, strict=True):
        y, law, unit, what = map_.of(name, node)
        angle = np.mod(map_.ratio(node) * map_.x, 2 * np.pi)[map_.rows]
        edges = np.linspace(0, 2 * np.pi, 97)
        index = np.clip(np.digitize(angle, edges) - 1, 0, 95)
        empty = np.full(96, np.nan)
        curves = np.stack([empty, empty])
        for k in np.unique(index):
            curves[:, k] = [np.median(v[map_.rows][index == k]) - np.median(v) for v in (y, law)]
        scale, shown = prefixed(curves, unit)
        radius = 1.6 * scale * float(np.nanmax(np.abs(curves)))
        middles = np.append(0.5 * (edges[1:] + edges[:-1]), edges[0] + 0.5 * edges[1])
        for values, (text, _, color) in zip(curves, stages(d), strict=False):
            text = "missing before" if text == "before" else "the law that was found"
            ax.plot(middles, np.append(values, values[0]) * scale, color=color, lw=1.5, label=text)
        ax.set_rlim(-radius, 0.75 * radius)
        ax.set_rticks([-radius / 2, 0, radius / 2], [f"{v:.2g}" for v in (-radius / 2, 0, radius / 2)])
        ax.spines["polar"].set_visible(False)
        label(ax, title=f"{what} around {words.node_words(node, d.owner.units)}, {shown}")
        legend(ax, loc="upper left", bbox_to_anchor=(1.02, 1.0))
    return figure


def turn_map(d: Diagnosis, sim: Simulator | None = None) -> Figure | None:
    """What the axis meets over one turn, with its band, and its strongest orders; None where it does not turn."""
    found = turn.of_diagnosis(d)
    if found is None:
        return None
    scale, unit = prefixed(found.torque, "Nm")
    figure, (top, low) = new(4.8, 2, 1, height_ratios=(1.5, 1))
    degrees = np.degrees(found.angle)
    y, half = scale * found.torque, scale * found.band
    top.fill_between(degrees, y - half, y + half, color=NOISE, alpha=0.35, lw=0, label="95 %")
    often = int(np.median(found.visits))
    top.plot(degrees, y, color=AFTER, lw=1.2, label="one visit" if often < 2 else f"mean of {often} visits")
    top.set_xticks(range(0, 361, 45))
    label(top, "angle, degrees", f"missing torque, {unit}")
    legend(top, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    low.bar([o.order for o in found.orders], [scale * o.amplitude for o in found.orders], width=0.6, color=BEFORE)
    for o in found.orders[:3]:
        low.annotate(f"{o.order:g}", (o.order, scale * o.amplitude), ha="center", va="bottom", fontsize=8.5, color=INK)
    low.set_xlim(0, turn.FINEST)
    low.margins(y=0.15)
    label(low, "times a turn", f"amplitude, {unit}")
    return figure


def spectra(d: Diagnosis, sim: Simulator) -> Figure:
    """Error on the recorded track by frequency and by order of the main shaft, with the null bands."""
    models = stages(d)
    node = next((n for _, n, axis in subjects(d) if axis == "angle"), subjects(d)[0][1])
    figure, (left, right) = new(5.6, 2, 1)
    first = slice(d.fit_rows[0], None)
    unit, rate = words.main_unit(d), 1.0 / d.record.dt
    map_ = Missing(d, sim)
    x, along = map_.ratio(node) * map_.x[first], f"order of {words.node_words(node, d.owner.units)}, per turn"
    if map_.slides(node):
        x, along = (
            x * 2 * np.pi / (float(np.ptp(x)) or 1.0),
            f"waves along the way of {words.node_words(node, d.owner.units)}",
        )
    thinned = slice(None, None, max(1, len(x) // 3000))
    size = min(len(x), max(256, int(4 * rate)))
    for name, model, color in models:
        e = (sim.seen - sim.run(model, TRACK)[:, 0])[first]
        f, p = welch(np.nan_to_num(e), rate, nperseg=size)
        left.loglog(f[1:], np.sqrt(p[1:]), color=color, lw=0.9, label=name)
        push = observe(sim, model)[1][first]
        share = 100 * spectrum(x[thinned], push[thinned], ORDERS)
        right.plot(ORDERS, share, color=color, lw=1.0, label=name)
    segments = max(1.0, 2.0 * len(x) / size - 1)
    noise = words.heldout_error(d, d.noise_floor)
    band = max(noise, 1e-12) / np.sqrt(rate / 2) * np.sqrt(chi2.ppf((0.025, 0.975), 1.2 * segments) / (1.2 * segments))
    left.axhspan(*band, color=NOISE, alpha=0.4, lw=0, label="white noise alone, 95 %")
    null = _order_null(share)
    right.fill_between(ORDERS, 0, null, color=NOISE, alpha=0.3, lw=0, label="no line stands out, 95 %")
    label(left, "frequency, Hz", f"error, {unit}/rtHz")
    label(right, along, "share of the missing force, %")
    right.set_ylim(0, None)
    for ax in (left, right):
        legend(ax, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=1 + len(models))
    return figure


def _order_null(share: np.ndarray, around: int = 12) -> np.ndarray:
    """What the highest of all orders reaches by chance about the local median, for exponential lines."""
    padded = np.pad(share, around, mode="reflect")
    median = np.array([np.median(padded[k : k + 2 * around + 1]) for k in range(len(share))])
    return median * np.log(1 - 0.95 ** (1 / len(share))) / np.log(0.5)


def evidence_bars(d: Diagnosis, sim: Simulator | None = None) -> Figure:
    """What each hypothesis explains of the error's excess, with the null line; look-alikes stand in one bracket."""
    bars = sorted(d.evidence, key=lambda e: -e.gain)
    found = {f"{e.name}:{e.node}" for e in d.effects}
    wanted = found | {f"{r.name}:{r.node}" for e in d.effects for r in e.look_alikes}
    top = [b for k, b in enumerate(bars) if k < MOST_BARS or (k < 3 * MOST_BARS and set(b.names) <= wanted)]
    figure, (ax,) = new(1.0 + 0.27 * max(len(top), 1))
    for row, bar in enumerate(top):
        color = AFTER if found == set(bar.names) else BEFORE if bar.fitted else SEEN
        ax.barh(row, 100 * bar.gain, color=color, height=0.7)
    ax.set_yticks(range(len(top)), [" + ".join(words.entry_noun(n, d.owner.units) for n in b.names) for b in top])
    ax.tick_params(axis="y", labelsize=8.5)
    ax.invert_yaxis()
    ax.set_xlim(0, 118)
    ax.set_xticks(range(0, 101, 20))
    ax.axvline(100 * d.null_line, color=INK, ls="--", lw=1.2, label=f"by chance: {words.percent(d.null_line)}")
    for k, e in enumerate(d.effects):
        same = {f"{e.name}:{e.node}"} | {f"{r.name}:{r.node}" for r in e.look_alikes}
        rows = [i for i, b in enumerate(top) if len(b.names) == 1 and b.names[0] in same]
        if len(rows) > 1:
            x = 102 + 4.5 * k
            ax.plot([x, x + 2, x + 2, x], [rows[0], rows[0], rows[-1], rows[-1]], color=INK, lw=1.1)
            ax.plot([x + 2] * len(rows), rows, "_", color=INK, ms=5)
    for color, text in ((AFTER, "found"), (BEFORE, "fitted in full"), (SEEN, "first look only")):
        ax.barh(np.nan, 0, color=color, label=text)
    more = len(bars) - len(top)
    label(ax, "excess error that it explains, %" + (f"; {more} more lie lower" if more > 0 else ""))
    ax.grid(axis="y", visible=False)
    legend(ax, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def where_map(d: Diagnosis, sim: Simulator) -> Figure:
    """Error of each channel in each regime of the motion, by what its sensor resolves, before and after."""
    problem = Problem(sim, channels=range(len(sim.channels)))
    parts = regimes(d, sim)
    models = stages(d)
    figure, axes = new(1.1 + (0.35 * len(sim.channels) + 0.5) * len(models), len(models), 1, sharex=True)
    for ax, (name, model, _) in zip(axes, models, strict=True):
        e = np.stack([sim.record.y[c] + sim.half for c in sim.channels], axis=1) - sim.run(model, TRACK)
        e[:, 1:] -= uniform_filter1d(e[:, 1:], max(3, round(1.0 / d.record.dt)), axis=0)  # counters drift, rates do not
        level = np.array([[np.sqrt(np.nanmean(e[rows, c] ** 2)) for rows in parts.values()] for c in problem.channels])
        level /= problem.sigma[:, None]
        ax.imshow(level, norm=LogNorm(0.5, 50), cmap="Oranges", aspect="auto")
        for (row, column), value in np.ndenumerate(level):
            color = "#ffffff" if value > 8 else "#3a2a10"
            ax.text(column, row, words.figures(value, 2), ha="center", va="center", fontsize=8, color=color)
        ax.set_yticks(range(len(sim.channels)), [c.removesuffix("_counts") for c in sim.channels])
        ax.set_xticks(range(len(parts)), list(parts), rotation=35, ha="right")
        ax.grid(visible=False)
        label(ax, title=f"{name}: rms error, 1 is what the sensor resolves")
    return figure


def regimes(d: Diagnosis, sim: Simulator) -> dict[str, np.ndarray]:
    """Rows (m,) of each regime that the record has, by its name."""
    n, first = len(d.record.t), d.fit_rows[0]
    x = sim.seen
    v = speed(x, d.record.plant, d.record.dt)
    top, u = float(np.quantile(np.abs(v), 0.95)), np.abs(d.record.u).max(axis=1)
    slow = np.abs(v) < 0.2 * top
    turns = np.abs(uniform_filter1d(np.sign(v), max(3, round(0.1 / d.record.dt)))) < 0.9
    low, high = np.quantile(x, (1 / 3, 2 / 3))
    k = np.arange(n)
    masks = {
        "at rest": np.abs(v) < 0.02 * top, "slow": slow, "fast forwards": ~slow & (v > 0),
        "fast backwards": ~slow & (v < 0), "reversing": turns & (np.abs(v) < 0.5 * top),
        "hard work": u > np.quantile(u, 0.8), "low position": x < low, "middle": (x >= low) & (x <= high),
        "high position": x > high, "begin": k < n // 3, "end": k > 2 * n // 3,
    }  # fmt: skip
    rows = {name: np.flatnonzero(mask & (k >= first)) for name, mask in masks.items()}
    return {name: found for name, found in rows.items() if len(found) > 20}


def parameters(d: Diagnosis, sim: Simulator | None = None) -> Figure:
    """Fitted parameters over the nominal values with their 90 % intervals, and the tolerance where there is one."""
    names = [n for n in FITTED[d.record.plant] if n in d.parameters and d.owner.base.get(n)]
    figure, (ax,) = new(0.9 + 0.24 * max(len(names), 1))
    for row, name in enumerate(names):
        v, owner = d.parameters[name], d.owner.base[name]
        tolerance = 100 * d.record.case.tolerance(name)
        if np.isfinite(tolerance):
            ax.barh(row, 2 * tolerance, left=-tolerance, color=SEEN, alpha=0.25, height=0.8)
        value, low, high = (100 * (x / owner - 1) for x in (v.value, v.low, v.high))
        ends = [[max(value - low, 0)], [max(high - value, 0)]]
        ax.errorbar(value, row, xerr=ends, fmt="o", ms=4, color=AFTER, capsize=3)
    ax.axvline(0, color=INK, lw=0.8)
    estimated = d.record.case.estimated
    ax.set_yticks(range(len(names)), [f"{n} (estimated)" if n in estimated else n for n in names])
    ax.invert_yaxis()
    label(ax, "fitted over the nominal value, %; grey: its tolerance, where it has one")
    return figure


def coverage(d: Diagnosis, sim: Simulator | None = None) -> Figure:
    """Which effect could be tested at which node: dots where it could, crosses where this record cannot show it."""
    plant, cannot = d.record.plant, set(d.cannot_test)
    where = {n: there for n, term in TERMS.items() if (there := physics.nodes(term, plant))}
    names = list(where)
    nodes = list(dict.fromkeys(node for there in where.values() for node in there))
    figure, (ax,) = new(1.1 + 0.2 * len(names))
    for row, name in enumerate(names):
        for node in where[name]:
            blind = f"{name}:{node}" in cannot
            ax.plot(nodes.index(node), row, "x" if blind else "o", ms=6, color=BEFORE if blind else AFTER)
    ax.set_yticks(range(len(names)), [words.noun(n) for n in names])
    ax.set_xticks(
        range(len(nodes)),
        [words.node_words(n, d.owner.units).removeprefix("the ") for n in nodes],
        rotation=30,
        ha="left",
    )
    ax.tick_params(axis="both", labelsize=8.5)
    ax.xaxis.tick_top()
    ax.invert_yaxis()
    return figure
