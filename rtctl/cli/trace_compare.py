"""What `rtctl trace compare` prints and draws."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtctl.trace.compare import Comparison

PEN = {"a": "#222222", "b": "#0b62a8", "difference": "#b3262e"}
DRAWN = (
    "capstan",
    "position",
    "x",
    "capstan_error",
    "position_error",
    "u1",
    "u2",
    "u",
)  # drawn if none are chosen


def say(found: "Comparison") -> list[str]:
    """Lines of text for a comparison."""
    how = f"aligned by {found.aligned}" + (f", B is {found.offset:+d} ticks" if found.offset else "")
    lines = [f"A {found.a.folder}", f"B {found.b.folder}", f"{how}, {len(found.rows_a)} ticks in common"]
    if found.different:
        lines.append(f"{'B - A':28}{'rms':>11}{'largest':>11}{'at tick':>10}   first differs")
    for s in found.different:
        name = f"{s.column} [{s.unit}]" if s.unit else s.column
        lines.append(
            f"  {name:26}{s.rms:11.4g}{s.largest:11.4g}{s.largest_tick:10}   tick {s.first_tick} ({s.first_t:g} s)"
        )
    equal = [s.column for s in found.signals if not s.ticks]
    if equal:
        lines.append(f"the same to the bit: {', '.join(equal)}")
    for which, names in (("A", found.only_a), ("B", found.only_b)):
        if names:
            lines.append(f"only in {which}: {', '.join(names)}")
    return lines + _steps(found)


def _steps(found: "Comparison") -> list[str]:
    from rtctl.trace.metrics import final_error_key, final_error_unit

    count = max(len(found.steps_a), len(found.steps_b))
    if not count:
        return []
    unit = final_error_unit([*found.steps_a, *found.steps_b])
    final = f"final error [{unit or '-'}]"
    lines = [f"{'step':>4}{final:>24}{'overshoot [%]':>24}{'settling [s]':>24}",
             " " * 4 + f"{'A':>14}{'B':>10}" * 3]  # fmt: skip
    for k in range(count):
        pair = [steps[k] if k < len(steps) else {} for steps in (found.steps_a, found.steps_b)]
        keys = final_error_key(unit), "overshoot_pct", "settling_s"
        cells = [_cell(step.get(key)) for key in keys for step in pair]
        lines.append(f"{k + 1:4}" + "".join(f"{c:>{10 if i % 2 else 14}}" for i, c in enumerate(cells)))
    return lines


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def draw(found: "Comparison", path: Path, chosen: bool) -> None:
    """Draw A, B and B - A into a PNG: all compared signals if `chosen`, else motion and outputs."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from rtctl.trace.plot import envelope, save

    by_name = {s.column: s for s in found.signals}
    signals = [by_name[name] for name in (by_name if chosen else DRAWN) if name in by_name] or list(found.signals[:6])
    t = found.a.columns["t"][found.rows_a]
    figure = Figure(figsize=(10.0, 2.6 * len(signals) + 0.6), layout="constrained")
    FigureCanvasAgg(figure)
    every = figure.subplots(len(signals), 2, sharex=True, squeeze=False)
    for (left, right), s in zip(every, signals, strict=True):
        one, two = (x.columns[s.column][rows] for x, rows in ((found.a, found.rows_a), (found.b, found.rows_b)))
        left.plot(*envelope(t, one), color=PEN["a"], lw=1.2, label="A")
        left.plot(*envelope(t, two), color=PEN["b"], lw=0.9, ls="--", label="B")
        right.plot(*envelope(t, two - one), color=PEN["difference"], lw=0.9)
        left.set_ylabel(f"{s.column} [{s.unit}]" if s.unit else s.column)
        right.set_title(f"B - A, rms {s.rms:.3g} {s.unit}".rstrip(), fontsize=9, loc="left")
        for axes in (left, right):
            axes.grid(True, color="#e3e5e8", linewidth=0.7)
            axes.spines[["top", "right"]].set_visible(False)
    every[0][0].legend(loc="upper right", frameon=False)
    for axes in every[-1]:
        axes.set_xlabel("t of A [s]")
    figure.suptitle(f"A {found.a.folder}   B {found.b.folder}", x=0.01, ha="left", fontsize=10)
    save(figure, path)
