"""Report of an improvement: a self-contained HTML file, and a table for the terminal."""

from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rtctl import __version__
from rtctl.diagnose.answer import figure_style as style
from rtctl.diagnose.answer.page import Picture, svg
from rtctl.improve import words
from rtctl.improve.improve import Improved


def html(r: Improved, running: list[words.Row] | None = None) -> str:
    """The report as one text; `running` are figures of the running machine."""
    loader = ChoiceLoader([PackageLoader("rtctl.improve", "."), PackageLoader("rtctl.diagnose.answer", ".")])
    env = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    caption = (
        f"Motion of the {r.judge.words} on the emulated fitted model: reference, error and command, before and after."
    )
    return env.get_template("report.html.j2").render(
        kind="Improvement",
        title=r.config.name,
        headline=words.headline(r),
        proof=words.proof(r),
        figures_rows=words.rows(r.config, r.before.figures, r.after.figures, (r.margins_before, r.margins_after)),
        figures={"motion": Picture(svg(motion(r), "motion", caption), caption)},
        kept=words.kept_rows(r),
        notes=words.notes(r),
        given_up=words.given_up(r),
        left_out=words.left_rows(r),
        running=running or [],
        footer=f"rtctl {__version__}",
    )


def motion(r: Improved) -> Any:
    """Figure of reference, error and command over time."""
    unit, command = words.unit_of(r.config), words.command_of(r.config)
    figure, (first, second, third) = style.new(6.0, 3, 1, sharex=True)
    factor, shown = style.prefixed(r.before.ref, unit)
    first.plot(r.before.t, factor * r.before.ref, color=style.INK, lw=1.0, label="reference")
    pairs = ((r.before, style.BEFORE, "before"), (r.after, style.AFTER, "after"))
    scale, small = style.prefixed(r.before.ref - r.before.y, unit)
    for run, color, name in pairs:
        first.plot(*style.thin(run.t, factor * run.y), color=color, lw=1.0, label=name)
        second.plot(*style.thin(run.t, scale * (r.before.ref[: len(run.y)] - run.y)), color=color, lw=1.0, label=name)
        third.plot(*style.thin(run.t, run.u), color=color, lw=0.8, label=name)
    style.label(first, y=f"position, {shown}")
    style.label(second, y=f"error, {small}")
    style.label(third, x="time, s", y=f"command, {command}")
    style.legend(first, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def terminal(r: Improved, running: list[words.Row] | None = None) -> RenderableType:
    """Headline, figures, kept remedies and left-out remedies, for the console."""
    parts: list[RenderableType] = [Text(words.headline(r)), Text()]
    margins = (r.margins_before, r.margins_after)
    parts.append(
        _table(("", "before", "after", "change"), words.rows(r.config, r.before.figures, r.after.figures, margins))
    )
    if running:
        parts += [Text(), Text("on the machine that runs"), _table(("", "before", "after", "change"), running)]
    kept = [(title, against, f"{before} -> {after}") for title, against, _, before, after in words.kept_rows(r)]
    if kept:
        parts += [Text(), _table(("put in", "against", "error"), kept)]
    if left := words.left_rows(r):
        parts += [Text(), _table(("left out", "against", "why"), left)]
    parts += [Text(line, style="dim") for line in words.notes(r)]
    parts += [Text(f"given up: {line}", style="dim") for line in words.given_up(r)]
    return Group(*parts)


def _table(head: tuple[str, ...], rows: Any) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    for i, name in enumerate(head):
        numeric = head[1] == "before" and i > 0
        table.add_column(name, justify="right" if numeric else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    return table
