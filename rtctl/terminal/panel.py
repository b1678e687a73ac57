"""Panel of a running machine, for any width and height of the terminal.

From top to bottom: state lamp and clock, trip, signals against their references and limits, timing, sparklines, rows.
In little room the less important is left out: columns and parts of a line first, then lines.
"""

import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from rtctl.terminal.fit import GAP, Part, columns, fit
from rtctl.terminal.spark import WINDOW, Peaks, sparkline
from rtctl.terminal.traces import Traces
from rtctl.terminal.view import STYLE, Quantity, number, quantities, shown

WIDEST = 110  # cells; longer lines are hard to read
LABEL = 10  # cells
BAR = 21  # cells between the limits of an output
CELLS = {"label": LABEL, "measured": 10, "unit": 3, "error": 10, "reference": 11, "bar": BAR + 2}
ORDER = ("label", "measured", "unit", "error", "reference", "bar")  # from the most important to the least


class Line(NamedTuple):
    rank: int  # 0 is left out last
    text: Text


class Panel:
    """One frame of a machine. `status` is the reply of that command, `law` the law's settings, `left` the time left, s.

    Where the daemon no longer answers, the text `gone` replaces the time, and the values shown are old.
    """

    def __init__(
        self,
        status: dict[str, Any],
        law: dict[str, Any],
        traces: Traces,
        left: float | None = None,
        gone: str = "",
    ):
        self.status, self.law, self.traces, self.left, self.gone = status, law, traces, left, gone

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        width = min(options.max_width, WIDEST)
        height = max((options.height or console.size.height) - 1, 1)
        lines = list(self.lines(width, console.options.ascii_only))
        while len(lines) > height:
            worst = max(line.rank for line in lines)
            lines.remove(next(line for line in reversed(lines) if line.rank == worst))
        for line in lines:
            yield line.text

    def lines(self, width: int, ascii_only: bool) -> Iterator[Line]:
        """All lines for a terminal of `width` cells; the drawing leaves out those of the highest rank."""
        self._dots = "..." if ascii_only else "…"
        self._ascii = ascii_only
        self._width = width
        yield self._head()
        yield from self._trip()
        yield from self._table()
        yield from self._timing()
        yield from self._sparks()
        yield from self._rows()
        for lack in self.status["lacks"]:
            yield self._line(8, "lacks", Part(0, lack))
        for fault in self.status["faults"]:
            yield self._line(7, "fault", Part(0, f"{fault['fault']} at tick {fault['tick']}: {fault['what']}"))

    def _line(self, rank: int, label: str, *parts: Part) -> Line:
        room = max(self._width - LABEL - GAP, 0)
        text = Text(no_wrap=True, overflow="crop").append(f"{label:<{LABEL + GAP}}"[: self._width], "dim")
        return Line(rank, text.append_text(fit(list(parts), room, self._dots)))

    def _head(self) -> Line:
        s = self.status
        link = "" if s["mode"] == "fused" else f" over {s['link']}"
        clock = f"{s['signals'].get('t', 0.0):.1f} s"
        lamp = "*" if self._ascii else "●"
        state = Part(0, f" {lamp} {s['state']} ", "dim reverse" if self.gone else STYLE.get(s["state"], ""))
        if self.gone:
            return Line(0, fit([state, Part(1, self.gone, "bold red"), Part(2, s["name"])], self._width, self._dots))
        left = "" if self.left is None else f"{_time(self.left)} left"
        parts = [
            state,
            Part(1, s["name"], "bold"),
            Part(2, clock),
            Part(3, left),
            Part(4, f"{s['rate_hz']:g} Hz {s['mode']}{link}", "dim"),
            Part(5, f"pid {s['pid']}", "dim"),
        ]
        return Line(0, fit(parts, self._width, self._dots))

    def _trip(self) -> Iterator[Line]:
        """Lines of the trip, wrapped between words; its cause is never cut."""
        trip = self.status["trip"]
        if not trip:
            return
        for line in textwrap.wrap(
            f"tripped at tick {trip['tick']}, {trip['code']}: {trip['why']}", max(self._width, 1)
        ):
            yield Line(1, Text(line, "bold red"))

    def _table(self) -> Iterator[Line]:
        found = quantities(self.status["signals"], self.traces.units, self.law)
        kept = columns(CELLS, ORDER, self._width)
        if "measured" not in kept:
            return  # a cut number misleads
        if found:
            yield Line(6, self._row({"measured": "measured", "reference": "reference", "error": "error"}, kept, "dim"))
        for q in found:
            yield Line(2, self._quantity(q, kept))

    def _quantity(self, q: Quantity, kept: set[str]) -> Text:
        cells = {
            "label": q.label,
            "measured": number(q.measured, q.unit),
            "unit": q.unit,
            "error": number(q.error, q.unit),
            "reference": number(q.reference, q.unit) if q.limits is None else _within(q.limits, self._ascii),
        }
        row = self._row(cells, kept)
        if q.limits is not None and "bar" in kept:
            row.append_text(self._bar(q.measured, *q.limits))
        return row

    def _row(self, cells: dict[str, str], kept: set[str], style: str = "") -> Text:
        row = Text(style=style, no_wrap=True, overflow="crop")
        for name in ("label", "measured", "reference", "error", "unit"):
            if name in kept:
                text = cells.get(name, "")
                left = name in ("label", "unit")
                row.append(f"{text:<{CELLS[name]}}" if left else f"{text:>{CELLS[name]}}")
                row.append(" " * GAP)
        if "bar" not in kept or not cells.get("unit"):
            row.rstrip()
        return row

    def _bar(self, value: float, low: float, high: float) -> Text:
        """Bar of an output between its limits, starting at zero; red at a limit."""
        at = [min(max(round((x - low) / (high - low) * (BAR - 1)), 0), BAR - 1) for x in (0.0, value)]
        full, zero = ("#", "|") if self._ascii else ("█", "┃")
        cells = [full if min(at) <= n <= max(at) else " " for n in range(BAR)]
        if at[0] == at[1]:
            cells[at[0]] = zero
        limited = value >= high - 1e-3 * (high - low) or value <= low + 1e-3 * (high - low)
        return Text("[").append("".join(cells), "red" if limited else "green").append("]")

    def _timing(self) -> Iterator[Line]:
        s = self.status
        period = 1e6 / s["rate_hz"]
        missed = Part(0, f"{s['missed']} missed", "bold red" if s["missed"] else "")
        overruns = Part(2, f"{s['overruns']} overruns", "bold red" if s["overruns"] else "")
        yield self._line(3, "ticks", missed, Part(1, f"{s['late']} late"), overruns, Part(3, f"of {s['ticks']}"))
        if s["mode"] == "real":
            yield self._line(5, "lateness", *_times(s["lateness_us"], period))
            yield self._line(9, "latency", *_times(s["link_latency_us"], None))
        yield self._line(8, "tick time", *_times(s["tick_us"], period))

    def _sparks(self) -> Iterator[Line]:
        name = self.traces.error_name
        if name is not None:
            top, unit = shown(self.traces.error.peak, self.traces.units[name])
            yield self._spark("|error|", self.traces.error, f"{top:.4g} {unit}", 4)
        if self.status["mode"] == "real":
            yield self._spark("lateness", self.traces.lateness, f"{1e6 * self.traces.lateness.peak:.0f} us", 4)

    def _spark(self, label: str, peaks: Peaks, top: str, rank: int) -> Line:
        if not peaks.peak >= 0:
            return self._line(rank, label, Part(0, "nothing yet", "dim"))
        of = f"of {WINDOW:g} s" + (", sampled" if self.traces.sampled else "")
        told = f"peak {top} {of}" if self._width >= 72 else top
        room = (
            self._width - LABEL - 2 * GAP - (32 if self._width >= 72 else 12)
        )  # the same for all, so that times line up
        bars = peaks.bars(max(min(room, 60), 1))
        return self._line(rank, label, Part(1, sparkline(bars, peaks.peak, self._ascii)), Part(0, told))

    def _rows(self) -> Iterator[Line]:
        rows = self.status["rows"]
        lost = rows["lost_in_ring"] + rows.get("lost", 0)
        filled = self.traces.filled
        parts = [
            Part(0, f"{lost} lost", "bold red" if lost else ""),
            Part(1, f"{rows['recorded']} recorded" if "recorded" in rows else "not recorded"),
            Part(2, rows.get("error") or "", "bold red"),
            Part(3, f"{rows['queued']} queued" if "queued" in rows else ""),
            Part(4, "" if filled is None else f"ring {100 * filled:.1f} % full"),
        ]
        yield self._line(2 if lost or rows.get("error") else 7, "rows", *parts)


def _within(limits: tuple[float, float], ascii_only: bool) -> str:
    low, high = limits
    if low == -high:
        return f"+-{high:g}" if ascii_only else f"±{high:g}"
    return f"{low:g}..{high:g}"


def _times(us: dict[str, float], period: float | None) -> list[Part]:
    """Parts with percentiles in us; the maximum is left out last, because it costs ticks."""
    of = "" if period is None else f"of {period:g} us"
    return [
        Part(3, f"p50 {_us(us['p50'])}"),
        Part(2, f"p99 {_us(us['p99'])}"),
        Part(1, f"p99.9 {_us(us['p999'])}"),
        Part(0, f"max {_us(us['max'])} us"),
        Part(4, of, "dim"),
    ]


def _us(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"
