"""Terminal output of `rtctl run`: a panel during the run (lines where there is no terminal), then a short report."""

import contextlib
import sys
import time
from collections.abc import Iterator
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rtctl.terminal.outlet import Outlet
from rtctl.terminal.panel import Panel
from rtctl.terminal.screen import Screen, takes_pictures
from rtctl.terminal.traces import Traces
from rtctl.terminal.view import plain

REFRESH = 0.25  # s between two frames of the panel
LINE = 2.0  # s between two lines where there is no terminal


class RunConsole:
    """Console that writes to standard error only, so that standard output holds only JSON."""

    def __init__(self, quiet: bool):
        self.outlet = Outlet(sys.stderr)
        self.console = Console(file=self.outlet)  # type: ignore[arg-type]
        self.quiet = quiet
        self._screen: Screen | None = None
        self._traces: Traces | None = None
        self._last = 0.0

    @property
    def log(self) -> Any:
        """The file for log lines: standard error, or above the panel while there is one."""
        return self._screen or self.outlet

    def say(self, message: str) -> None:
        """One line for the person at the terminal."""
        line = Text(message, "dim")
        if self._screen:
            self._screen.say(line)
        else:
            self.console.print(line, highlight=False, soft_wrap=True)

    @contextlib.contextmanager
    def live(self) -> Iterator[None]:
        """Context with a panel that is redrawn in place, on a terminal only."""
        if self.quiet or not takes_pictures(self.console):
            yield
            return
        with Screen(self.console, Text("starting ...")) as screen:
            self._screen = screen
            try:
                yield
            finally:
                self._screen = None

    def update(self, supervisor: Any) -> None:
        """Redraw the panel or print a line, if it is time; called in every cycle of the supervisor."""
        if self.outlet.gone:
            supervisor.terminal_gone = supervisor.interrupted = True
        now = time.monotonic()
        if self.quiet or now - self._last < (REFRESH if self._screen else LINE) or supervisor.last_row is None:
            return
        self._last = now
        status = supervisor.report()
        left = supervisor.ticks / supervisor.machine.rate - status["signals"]["t"] if supervisor.ticks else None
        if self._traces is None:
            self._traces = Traces(supervisor.signals())
        if self._screen:
            self._traces.update(status["signals"])
            law = supervisor.config.law.model_dump(mode="json")
            self._screen.show(Panel(status, law, self._traces, left))
        else:
            self.console.print(plain(status, self._traces.units, left), highlight=False, markup=False, soft_wrap=True)

    def report(self, result: dict[str, Any]) -> None:
        """Print the result of a run."""
        console, late = self.console, result["lateness_us"]
        link = "" if result["mode"] == "fused" else f" over {result['link']}"
        told = Text().append(result["name"], "bold")
        told.append(f"  {result['ticks']} ticks at {result['rate_hz']:g} Hz, {result['mode']}{link}: ")
        told.append(f"{result['missed']} missed", "bold red" if result["missed"] else "")
        told.append(f", {result['late']} late")
        if result["mode"] == "real":
            told.append(f", lateness p50 {late['p50']:.0f} p99.9 {late['p999']:.0f} max {late['max']:.0f} us")
        console.print(told)
        if result["steps"]:
            console.print(steps_table(result["steps"], console.width))
        lost = result["lost_rows"]
        if lost or result["missed"]:
            words = f"{lost} rows were lost and {result['missed']} ticks missed: "
            words += (
                "steps that they fall into are not measured right" if result["steps"] else "the recording has holes"
            )
            console.print(Text(words + ("; the bundle's case.json says which rows" if lost else ""), "red"))
        if result["trip"]:
            console.print(Text(f"tripped at tick {result['trip']['tick']}: {result['trip']['why']}", "bold red"))
        elif result["interrupted"]:
            console.print("ended by Ctrl-C or SIGTERM, outputs at zero")
        rows = result["rows"]
        if rows.get("error"):
            console.print(Text(f"recording: {rows['error']}", "red"))
        for what in ("bundle", "plot"):
            if result.get(what):
                console.print(f"{what:7}{result[what]}", highlight=False, markup=False, soft_wrap=True)


STEP_COLUMNS = {  # heading -> rank; on a narrow terminal the column of the highest rank is dropped first
    "t \\[s]": 0, "size": 3, "final error \\[rad]": 4, "\\[mm]": 1, "overshoot \\[%]": 5, "settling \\[s]": 2,
}  # fmt: skip


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def steps_table(steps: list[dict[str, Any]], width: int) -> Table:
    """Table with one row for each step, in columns that fit into `width` cells."""
    kept = sorted(STEP_COLUMNS, key=STEP_COLUMNS.__getitem__)
    while sum(max(len(name) - name.count("\\"), 7) + 2 for name in kept) > width + 2 and len(kept) > 1:
        kept.pop()
    chosen = [n for n, name in enumerate(STEP_COLUMNS) if name in kept]
    table = Table(box=None, pad_edge=False)
    names = list(STEP_COLUMNS)
    for n in chosen:
        table.add_column("final \\[mm]" if names[n] == "\\[mm]" and n - 1 not in chosen else names[n], justify="right")
    for s in steps:
        cells = (
            f"{s['t']:.2f}",
            f"{s['size']:+.4g}",
            _number(s["final_error_rad"], "+.2e"),
            _number(s["final_error_mm"], "+.4f"),
            f"{s['overshoot_pct']:.1f}",
            "-" if s["settling_s"] is None else f"{s['settling_s']:.2f}",
        )
        table.add_row(*(cells[n] for n in chosen))
    return table
