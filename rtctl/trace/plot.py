"""Figure of a run: panels of position and reference, error, outputs and tension over a common time axis."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.config.errors import UserError
from rtctl.config.files import replaced
from rtctl.machines.profiles import profile_of
from rtctl.trace.bundle import Bundle
from rtctl.trace.metrics import final_error_key, final_error_unit

BUCKETS = 1500  # about the width of a panel in pixels


class Trace(NamedTuple):
    column: str
    label: str
    color: str
    style: str = "-"


class Panel(NamedTuple):
    title: str
    unit: str | None  # None: the unit of the position
    traces: tuple[Trace, ...]


INK, BLUE, ORANGE, GREEN, RED, GREY = "#222222", "#0b62a8", "#d9730d", "#2e8b57", "#b3262e", "#8a8f98"
COLORS = (BLUE, ORANGE, GREEN, RED, GREY)
PANELS = (
    Panel(
        "Position",
        None,
        (
            Trace("target", "target", GREY, ":"),
            Trace("truth_x", "true", GREEN),
            Trace("capstan", "capstan", BLUE),
            Trace("position", "measured", BLUE),
            Trace("x", "measured", BLUE),
            Trace("feedback", "measured", BLUE),
            Trace("ref", "reference", INK, "--"),
        ),
    ),
    Panel(
        "Error",
        None,
        (
            Trace("capstan_error", "reference - measured", RED),
            Trace("position_error", "reference - measured", RED),
            Trace("error", "reference - measured", RED),
        ),
    ),
    Panel("Output", "V", (Trace("u", "u", BLUE), Trace("u1", "u1", BLUE), Trace("u2", "u2", ORANGE))),
    Panel(
        "Tension",
        "N",
        (
            Trace("tension1_estimate", "tape 1, estimate", "#8fc1ea"),  # noisy: pale, and below the truth
            Trace("tension2_estimate", "tape 2, estimate", "#f4bd8a"),
            Trace("truth_tension1", "tape 1, true", BLUE),
            Trace("truth_tension2", "tape 2, true", ORANGE),
        ),
    ),
    Panel(
        "Counters",
        "counts",
        (
            Trace("capstan_counts", "capstan", BLUE),
            Trace("encoder_counts", "encoder", BLUE),
            Trace("scale_counts", "scale", ORANGE),
            Trace("reel1_counts", "reel 1", GREEN),
            Trace("reel2_counts", "reel 2", GREY),
        ),
    ),
)
SPARE = "Counters"  # drawn only where there is no position beside the reference
METRES = ("position", "x", "truth_x", "encoder_counts")  # a machine with one of these is linear


def plot_run(
    run: Bundle | Mapping[str, np.ndarray],
    metrics: Sequence[Mapping[str, Any]],
    path: Path | str,
    title: str | None = None,
) -> Path:
    """Draw the known columns of a bundle, or of a dict with `t` in s, into a PNG at `path`; returns the path.

    Raises as `figure_of`, and UserError where the file cannot be written.
    """
    save(figure_of(run, metrics, title), Path(path), "")
    return Path(path)


def figure_of(
    run: Bundle | Mapping[str, np.ndarray], metrics: Sequence[Mapping[str, Any]], title: str | None = None
) -> Figure:
    """Figure of the known columns of a run.

    `metrics` come from `step_metrics` and may be empty. The default title is the machine and date of the case.
    Raises ValueError where there is no `t`, or nothing to draw.
    """
    bundle = run if isinstance(run, Bundle) else None
    columns = dict(run) if bundle is None else bundle.columns  # type: ignore[arg-type]
    if not len(columns.get("t", ())):
        raise ValueError("nothing to draw: there is no column 't', or it is empty")
    panels = _panels(columns, {} if bundle is None else bundle.units)
    if not panels:
        raise ValueError(f"nothing to draw: none of the columns {', '.join(columns)} is known")
    heights = [1.5 if panel.title == "Position" else 1.0 for panel in panels]
    figure, every = _drawn(panels, columns, heights)
    for axes in every:
        for step in metrics:
            axes.axvline(step["t"], color=GREY, linewidth=0.8, linestyle=":", zorder=0)
    words = title or _title({} if bundle is None else bundle.case)
    figure.suptitle(words, x=0.01, ha="left", fontsize=14, fontweight="bold")
    if metrics:
        every[0].set_title(summary(metrics), loc="left", fontsize=10, color="#444444")
    return figure


def figure_of_columns(bundle: Bundle, names: Sequence[str]) -> Figure:
    """Figure of columns of a bundle over time, one panel for each unit."""
    units = dict.fromkeys(bundle.units.get(name, "") for name in names)
    panels = []
    for unit in units:
        there = [name for name in names if bundle.units.get(name, "") == unit]
        traces = tuple(Trace(name, name, COLORS[k % len(COLORS)]) for k, name in enumerate(there))
        panels.append(Panel(there[0] if len(there) == 1 else "", unit, traces))
    return _drawn(panels, bundle.columns, [1.0] * len(panels))[0]


def _drawn(
    panels: Sequence[Panel], columns: Mapping[str, np.ndarray], heights: Sequence[float]
) -> tuple[Figure, list[Axes]]:
    """Figure and axes of panels over a common time axis."""
    figure = Figure(figsize=(11, 1.2 + 1.6 * sum(heights)), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    every = list(figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0])
    for axes, panel in zip(every, panels, strict=True):
        _draw(axes, panel, columns)
    every[-1].set_xlabel("time [s]")
    if columns["t"][-1] > columns["t"][0]:
        every[-1].set_xlim(float(columns["t"][0]), float(columns["t"][-1]))
    figure.align_ylabels(every)
    return figure, every


def save(figure: Figure, path: Path, option: str = "--plot ") -> None:
    """Write a figure to `path`; messages name `option`. Raises UserError where the file cannot be written."""
    kinds = sorted(figure.canvas.get_supported_filetypes())
    if path.is_dir() or path.suffix.removeprefix(".").lower() not in kinds:
        why = "a folder" if path.is_dir() else "no kind of picture"
        raise UserError(f"{option}{path}: is {why}; name a file that ends in .png, .svg or .pdf")
    if not path.parent.is_dir():
        raise UserError(f"{option}{path}: cannot be written (there is no folder {path.parent})")
    try:
        with replaced(path, "wb") as file:
            figure.savefig(file, format=path.suffix.removeprefix(".").lower())
    except OSError as error:
        raise UserError(f"{option}{path}: cannot be written ({error.strerror or error})") from None


def summary(metrics: Sequence[Mapping[str, Any]]) -> str:
    """Step metrics of a run in one line."""
    unit = final_error_unit(metrics)
    worst = max((step[final_error_key(unit)] for step in metrics), key=abs)
    over = max(step["overshoot_pct"] for step in metrics)
    times = [step["settling_s"] for step in metrics]
    settled = [s for s in times if s is not None]
    parts = [
        "1 step" if len(metrics) == 1 else f"{len(metrics)} steps",
        f"largest final error {worst:.3g} {unit}",
        f"largest overshoot {over:.3g} %",
        f"slowest settling {max(settled):.3g} s" if settled else "",
        f"{times.count(None)} did not settle" if None in times else "",
    ]
    return "   |   ".join(part for part in parts if part)


def envelope(t: np.ndarray, y: np.ndarray, buckets: int = BUCKETS) -> tuple[np.ndarray, np.ndarray]:
    """Min-max envelope of a signal for drawing: times and values, at most about `2 * buckets` points.

    A bucket drops its nan where it has other values. Short signals are returned unchanged.
    """
    if len(t) <= 2 * buckets:
        return t, y
    edges = np.linspace(0, len(t), buckets + 1).astype(int)
    first, last = edges[:-1], edges[1:] - 1
    least, greatest = np.fmin.reduceat(y, first), np.fmax.reduceat(y, first)
    falls = y[last] < y[first]  # greatest first: least first would draw a falling line as a zigzag
    values = np.column_stack((np.where(falls, greatest, least), np.where(falls, least, greatest))).ravel()
    times = np.column_stack((t[first], t[last])).ravel()
    return times, values


def _panels(columns: Mapping[str, np.ndarray], units: Mapping[str, str]) -> list[Panel]:
    """Panels with at least one existing column, with their unit and without missing traces."""
    linear = any(name in columns for name in METRES)
    found = []
    for panel in PANELS:
        traces = tuple(trace for trace in panel.traces if trace.column in columns)
        if traces:
            named = next((units[trace.column] for trace in traces if trace.column in units), None)
            found.append(Panel(panel.title, named or panel.unit or ("m" if linear else "rad"), traces))
    position = next((panel for panel in found if panel.title == "Position"), None)
    measured = position is not None and any(trace.column != "ref" for trace in position.traces)
    return [panel for panel in found if not (panel.title == SPARE and measured)]


def _draw(axes: Axes, panel: Panel, columns: Mapping[str, np.ndarray]) -> None:
    t = np.asarray(columns["t"], dtype=float)
    drawn = [(trace, *envelope(t, np.asarray(columns[trace.column], dtype=float))) for trace in panel.traces]
    factor, unit = _prefixed(panel.unit or "", max(_largest(y) for _, _, y in drawn))
    for trace, x, y in drawn:
        axes.plot(x, y * factor, trace.style, color=trace.color, linewidth=1.2, label=trace.label)
    axes.set_ylabel(f"{panel.title.lower()} [{unit}]".strip())
    axes.grid(True, color="#e3e5e8", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(y=0.08)
    axes.legend(loc="upper left", bbox_to_anchor=(1.005, 1.0), frameon=False, fontsize=9, borderaxespad=0.0)


def _largest(y: np.ndarray) -> float:
    finite = np.abs(y[np.isfinite(y)])
    return float(finite.max()) if len(finite) else 0.0


def _prefixed(unit: str, largest: float) -> tuple[float, str]:
    """Factor and unit with SI prefix that bring the largest value to 0.5 or more: 2e-4 m is 200 um."""
    if unit not in ("m", "rad", "N", "V") or not largest:
        return 1.0, unit
    thousands = min(3, max(0, math.ceil(-math.log10(2 * largest) / 3)))
    return 1000.0**thousands, ("", "m", "µ", "n")[thousands] + unit


def _title(case: Mapping[str, Any]) -> str:
    described = isinstance(case.get("machine"), Mapping)
    named = (case.get("config") or {}).get("name") if described else case.get("machine")
    machine = named or profile_of(str(case.get("plant"))).title or case.get("plant") or "Run"
    date = str(case.get("recorded_at", "")).replace("T", " ").removesuffix("+00:00")
    return f"{machine}, {date} UTC" if date else str(machine)
