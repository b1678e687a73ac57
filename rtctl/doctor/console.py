"""Terminal output of `rtctl doctor`: a bar, then checks, histograms, sentences and what to change."""

import contextlib
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from rtctl.doctor import draw
from rtctl.doctor.facts import changes
from rtctl.doctor.finding import Finding
from rtctl.doctor.measure import Measured, Rate, words
from rtctl.doctor.report import figures, sentence
from rtctl.doctor.spin import advice

COLOUR = {"good": "green", "fair": "yellow", "bad": "bold red", "unknown": "dim"}


@contextlib.contextmanager
def progress(quiet: bool) -> Iterator[Callable[[float, str], None]]:
    """Context with a function to call with the share done and a word: a bar on a terminal, nothing elsewhere."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda share, word: None
        return
    columns = (BarColumn(24), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda share, word: bar.update(task, completed=share, description=word)


def show(console: Console, title: str, findings: list[Finding], measured: Measured | None) -> None:
    """Print the whole report."""
    console.print(Text(title, "bold"))
    console.print(checks(findings))
    if measured is not None:
        _measurement(console, measured)
        if (spin := advice(findings, measured.rates)) is not None:
            console.print(Text(spin.sentence))
    _changes(console, changes(findings))


def checks(findings: list[Finding]) -> Table:
    """Table with a row for each check."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("check")
    table.add_column("verdict")
    table.add_column("found", overflow="fold")
    for f in findings:
        table.add_row(Text(f.name), Text(f.verdict, COLOUR[f.verdict]), Text(f.found))
    return table


def _measurement(console: Console, measured: Measured) -> None:
    seconds = measured.rounds * measured.window_s
    console.print()
    console.print(
        Text(
            f"The empty loop on CPU {measured.cpu}, {seconds} s at each rate"
            + (f"; {measured.without}" if measured.without else ", and cyclictest in alternating windows")
        )
    )
    for lack in measured.lacks:
        console.print(Text(f"note: {lack}", "yellow"))
    for rate in measured.rates:
        _histograms(console, rate)
    console.print()
    for rate in measured.rates:
        console.print(Text(sentence(rate), "green" if rate.held else "bold red"))


def _histograms(console: Console, rate: Rate) -> None:
    both = [("rtctl", rate.ours), *([("cyclictest", rate.cyclictest)] if rate.cyclictest else [])]
    axis = draw.axis([h for _, h in both], console.width)
    blocks = (console.encoding or "").lower().startswith("utf")
    for name, h in both:
        console.print()
        console.print(Text(f"{name} at {words(rate.hz)}: {figures(h)}"))
        for line in (*draw.lines(h, axis, blocks), *draw.foot(axis)):
            console.print(Text(line), no_wrap=True, crop=True, overflow="crop")


def _changes(console: Console, wanted: list[Finding]) -> None:
    console.print()
    if not wanted:
        console.print(Text("Nothing to change was found.", "green"))
        return
    console.print(Text("What to change, what gains most first", "bold"))
    for number, f in enumerate(wanted, 1):
        table = Table.grid(padding=(0, 1))
        table.add_row(f"{number:2}", Text.assemble((f.name, COLOUR[f.verdict]), f": {f.cost}"))
        table.add_row("", Text(f.change))
        console.print(table)
        console.print(Text(f"     {f.command}", "dim"), soft_wrap=True)  # not wrapped, to be copied
