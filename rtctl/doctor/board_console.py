"""Wiring checks at a terminal: the instruction, the card's readings meanwhile, and Enter when it is done."""

import select
import sys
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.text import Text

from rtctl.doctor.board import Sample, Step
from rtctl.doctor.finding import Finding

COLOURS = {"good": "green", "fair": "yellow", "bad": "red", "unknown": "dim"}
EVERY = 0.005  # s between two readings; resolves a reel that turns in ten seconds


class Terminal:
    """Person at a terminal."""

    def __init__(self, console: Console, lines: Any = None) -> None:
        self._console = console
        self._lines = lines or sys.stdin

    def act(self, step: Step, read: Callable[[], Sample]) -> bool:
        """Show readings until Enter; `s` and Enter leave the step out."""
        self._ask(step, "Enter when it is done, s to leave it out")
        with Live(console=self._console, refresh_per_second=10, transient=True) as live:
            while True:
                live.update(shown(read()))
                if select.select([self._lines], [], [], EVERY)[0]:
                    return not self._answer().startswith("s")

    def confirm(self, step: Step) -> bool | None:
        """y, n, or s to leave it out."""
        self._ask(step, "is it so? y, n, or s to leave it out")
        while True:
            said = self._answer()[:1]
            if said in ("y", "n", "s"):
                return {"y": True, "n": False, "s": None}[said]
            self._console.print("y, n or s", style="dim")

    def _ask(self, step: Step, how: str) -> None:
        self._console.print(f"\n[bold]{step.name}[/bold]: {step.do}\n  right is: {step.right}\n  [dim]{how}[/dim]")

    def _answer(self) -> str:
        line = self._lines.readline()
        return line.strip().lower() if line else "s"  # the input was closed


def shown(sample: Sample) -> Text:
    """Line of text for a reading."""
    counts = "  ".join(f"counter {n} {c:+d}" for n, c in enumerate(sample.counts))
    volts = "  ".join(f"input {n} {v:.3f} V" for n, v in enumerate(sample.volts))
    return Text(f"  {counts}  {volts}".rstrip(), style="cyan")


def tell(console: Console, finding: Finding) -> None:
    """Print one finding."""
    colour = COLOURS[finding.verdict]
    console.print(f"  [{colour}]{finding.verdict:8}[/{colour}]{finding.name}: {finding.found}", highlight=False)
    if finding.change and finding.verdict == "bad":
        console.print(f"          {finding.change}", highlight=False)
