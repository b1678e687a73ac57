"""Terminal output of `rtctl diagnose`: a bar, then the verdict; with a folder a line for each bundle and a table."""

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

STAGES = {  # first words of a stage's text -> share of the work done when the stage begins
    "recording": 0.0, "preflight": 0.02, "fitting the nominal": 0.04, "screening": 0.15, "fitting": 0.25,
    "comparing": 0.6, "predicting": 0.9, "writing": 0.95,
}  # fmt: skip
FIRST = "first look"  # first words of a text of rtctl/diagnose/search/first_look.py, whose import takes seconds
ONWARD = 0.12  # share of the remaining work, for a stage that repeats or is not in STAGES
COLOUR = {"named": "green", "ambiguous": "yellow", "unnamed": "magenta", "nothing": "cyan"}
MOST_EFFECTS = 8  # effects in the table of a folder, at most


class DiagnoseConsole:
    """Console with results on standard output and progress on standard error; with `json` all on standard error."""

    def __init__(self, json: bool):
        self.json = json
        self.err = Console(stderr=True)
        self.out = self.err if json else Console()

    @contextlib.contextmanager
    def stages(self) -> Iterator[Callable[[str], None]]:
        """Context with a function to call at each stage: a bar on a terminal, else a line with the elapsed time."""
        began = time.monotonic()
        if not self.err.is_terminal:

            def line(text: str) -> None:
                if not self.json:
                    self.err.print(
                        f"{time.monotonic() - began:6.1f} s  {text}", highlight=False, markup=False, soft_wrap=True
                    )

            yield line
            return
        columns = (SpinnerColumn(), BarColumn(24), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
        with Progress(*columns, console=self.err, transient=True) as bar:
            task = bar.add_task("reading", total=1.0)
            done = 0.0

            def show(text: str) -> None:
                nonlocal done
                if text.startswith(FIRST):  # the first look stays on the screen during the search
                    bar.console.print(f"{time.monotonic() - began:.1f} s  {text}", highlight=False, markup=False)
                    return
                done = onward(done, text)
                bar.update(task, completed=done, description=text)

            yield show

    @contextlib.contextmanager
    def many(self, count: int) -> Iterator[Callable[[Any], None]]:
        """Context with a function to call with each outcome of a folder of `count` bundles."""
        if not self.err.is_terminal:
            yield lambda outcome: self.out.print(line(outcome), soft_wrap=True)
            return
        columns = (SpinnerColumn(), BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn())
        with Progress(*columns, console=self.err, transient=True) as bar:
            task = bar.add_task("", total=count)

            def show(outcome: Any) -> None:
                (bar.console if self.out.is_terminal else self.out).print(line(outcome), soft_wrap=True)
                bar.advance(task)

            yield show

    def notes(self, sentences: list[str]) -> None:
        """Print the warnings beside the verdict, one line each."""
        for sentence in sentences:
            self.err.print(f"note: {sentence}", style="dim", highlight=False, markup=False, soft_wrap=True)

    def result(self, d: Any, folder: Path) -> None:
        """Print verdict, effects, look-alikes, and the paths of the written files."""
        from rtctl.diagnose.answer.report import terminal

        self.out.print(terminal(d), soft_wrap=not self.out.is_terminal)
        self.files(folder)

    def files(self, folder: Path) -> None:
        """Print the paths of the written files."""
        from rtctl.diagnose.answer.results import EXPERIMENT, MODEL, REPORT

        for word, name in (("report", REPORT), ("model", MODEL), ("experiment", EXPERIMENT)):
            if (folder / name).is_file():
                self.out.print(f"{word:11}{folder / name}", highlight=False, markup=False, soft_wrap=True)

    def repaired(self, made: Any, folder: Path, rows: list[tuple[str, str, str]]) -> None:
        """Print the last verdict and the changes to the nominal model: `rows` of key, old value and new value."""
        for bundle, trip in zip(made.bundles, made.trips, strict=True):
            self.out.print(f"{'recorded':11}{bundle}" + (f", tripped: {trip}" if trip else ""), highlight=False)
        self.result(made.last, folder)
        if not rows:
            self.out.print("The model is as it was.")
            return
        table = Table(box=None, pad_edge=False, header_style="dim")
        table.add_column("changed")
        table.add_column("was", justify="right")
        table.add_column("is", overflow="fold")
        for row in rows:
            table.add_row(*map(Text, row))
        self.out.print(table)

    def summary(self, outcomes: list[Any], seconds: float) -> None:
        """Print the counts of verdicts and effects over all bundles."""
        table = Table(box=None, pad_edge=False, header_style="dim")
        table.add_column(f"{len(outcomes)} bundles, {seconds:.0f} s")
        table.add_column("bundles", justify="right")
        verdicts = Counter(o.diagnosis["verdict"] if o.diagnosis else FAULTS[o.code] for o in outcomes)
        for verdict, count in verdicts.most_common():
            table.add_row(Text(verdict, COLOUR.get(verdict, "red")), str(count))
        effects = Counter(name for o in outcomes if o.diagnosis for name in {e["name"] for e in o.diagnosis["effects"]})
        for name, count in effects.most_common(MOST_EFFECTS):
            table.add_row(Text(f"  {name}"), str(count))
        self.out.print()
        self.out.print(table)


FAULTS = {1: "failed", 2: "invalid bundle", 3: "supports no verdict"}


def onward(done: float, text: str) -> float:
    """Share of the work done when a stage begins, 0 to 1; it falls only where another recording begins."""
    share = next((share for start, share in STAGES.items() if text.startswith(start)), None)
    if text.startswith("recording"):
        return 0.0
    if share is not None and share > done:
        return share
    return done + ONWARD * (1.0 - done)


def line(outcome: Any) -> Text:
    """Line for one bundle: name, verdict, effects with node and confidence, duration in s."""
    text = Text(f"{outcome.name:20} ")
    d = outcome.diagnosis
    if d is None:
        text.append(f"{FAULTS[outcome.code]}: {outcome.message}", "red")
        return text
    text.append(f"{d['verdict']:9}", COLOUR.get(d["verdict"], ""))
    for e in d["effects"]:
        text.append(f"  {e['name']} at {e['node']} {100 * e['confidence']:.0f} %")
    text.append("  done before" if outcome.skipped else f"  {outcome.seconds:.1f} s", "dim")
    if outcome.message:
        text.append(f"  ({outcome.message})", "red")
    return text
