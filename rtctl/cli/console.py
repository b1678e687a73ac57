"""What `rtctl run` shows: a live line while it runs and a short report after."""

import contextlib
import time
from collections.abc import Iterator
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from rtctl.loop import safety
from rtctl.loop.histogram import percentiles

REFRESH = 0.1  # s
POSITION = {
    "ivu": ("capstan", "capstan_error", "rad"),
    "ldu": ("position", "position_error", "m"),
    "axis": ("x", "position_error", "m"),
}
COLOUR = {"idle": "dim", "armed": "yellow", "running": "green", "tripped": "bold red"}


class RunConsole:
    """Everything goes to standard error, so that standard output is the JSON's alone."""

    def __init__(self, quiet: bool):
        self.console = Console(stderr=True)
        self.quiet = quiet
        self._live: Live | None = None
        self._last = 0.0

    def say(self, message: str) -> None:
        """One line for the person at the terminal."""
        (self._live.console if self._live else self.console).print(f"[dim]{message}[/dim]", highlight=False)

    @contextlib.contextmanager
    def live(self, session: Any) -> Iterator[None]:
        """A status line that refreshes in place, where there is a terminal."""
        if self.quiet or not self.console.is_terminal:
            yield
            return
        with Live(Text("starting ..."), console=self.console, refresh_per_second=10, transient=True) as live:
            self._live = live
            try:
                yield
            finally:
                self._live = None

    def update(self, supervisor: Any) -> None:
        """Called at every turn of the supervisor."""
        now = time.monotonic()
        if self.quiet or now - self._last < (REFRESH if self._live else 2.0) or supervisor.last_row is None:
            return
        self._last = now
        line = status_line(supervisor)
        if self._live:
            self._live.update(line)
        elif not self.console.is_terminal:
            self.console.print(line)

    def report(self, result: dict[str, Any]) -> None:
        """What came of the run."""
        console = self.console
        late = result["lateness_us"]
        console.print(
            f"[bold]{result['name']}[/bold]  {result['ticks']} ticks at {result['rate_hz']:g} Hz, {result['mode']}"
            f"{'' if result['mode'] == 'fused' else ' over ' + result['link']}: "
            f"{result['missed']} missed, {result['late']} late"
            + (f", lateness p50 {late['p50']:.0f} p99.9 {late['p999']:.0f} us" if result["mode"] == "real" else "")
        )
        if result["steps"]:
            console.print(steps_table(result["steps"]))
        if result["trip"]:
            console.print(f"[bold red]tripped at tick {result['trip']['tick']}: {result['trip']['why']}[/bold red]")
        lost = result["rows"].get("lost", 0)
        if lost:
            console.print(f"[red]{lost} rows were lost; the bundle's case.json says which[/red]")
        for what in ("bundle", "plot"):
            if result.get(what):
                console.print(f"{what:7}{result[what]}", highlight=False, soft_wrap=True)


def status_line(supervisor: Any) -> Text:
    """Rate, state, missed ticks, lateness, position, error, tension."""
    row, status = supervisor.last_row, supervisor.status
    state = safety.STATES[int(status["state"])]
    position, error, unit = POSITION[supervisor.machine.kind]
    scale, shown = (1.0, "rad") if unit == "rad" else (1000.0, "mm")
    line = Text()
    line.append(f"{row['t']:7.1f} s ", "dim")
    line.append(f" {state} ", COLOUR[state])
    line.append(f" {supervisor.machine.rate:g} Hz  missed {int(status['missed'])}")
    if supervisor.config.loop.mode == "real":
        line.append(f"  late p99.9 {percentiles(status['lateness'])['p999']:.0f} us")
    line.append(f"  {row[position] * scale:+.4f} {shown}  error {row[error] * scale:+.4f}")
    if supervisor.machine.kind == "ivu":
        line.append(f"  tension {row['tension1_estimate']:+.2f} {row['tension2_estimate']:+.2f} N")
    if state == "tripped":
        line.append(f"  {safety.TRIPS[int(status['trip'])][0]}", "bold red")
    return line


def steps_table(steps: list[dict[str, Any]]) -> Table:
    """One row a step."""
    table = Table(box=None, pad_edge=False)
    for name in ("t [s]", "size", "final error [rad]", "[mm]", "overshoot [%]", "settling [s]"):
        table.add_column(name.replace("[", "\\["), justify="right")
    for s in steps:
        table.add_row(
            f"{s['t']:.2f}",
            f"{s['size']:+.4g}",
            f"{s['final_error_rad']:+.2e}",
            f"{s['final_error_mm']:+.4f}",
            f"{s['overshoot_pct']:.1f}",
            "-" if s["settling_s"] is None else f"{s['settling_s']:.2f}",
        )
    return table
