"""`rtctl replay BUNDLE`: run a recording through its law again, and compare the outputs with the recorded ones."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption

if TYPE_CHECKING:
    from rtctl.trace.replay import Replayed

app = typer.Typer(add_completion=False)
MOST = 6  # signals listed, at most
PEN = {"recorded": "#222222", "replayed": "#0b62a8", "difference": "#b3262e"}


@app.command()
def replay(
    bundle: Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder of a run, with orders.jsonl.")],
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Another setting, to see the outputs that it gives."),
    ] = None,
    own: Annotated[
        list[Path] | None,
        typer.Option(
            "--own", metavar="FILE", help="Your file that the recording used, by path; its text must be unchanged."
        ),
    ] = None,
    json: JsonOption = False,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Draw both and their difference into a PNG.")
    ] = None,
) -> None:
    """Replay a recording through its own law and compare to the bit. Exit code 1 where it differs.

    With --set the measurements stay as recorded. The outputs show the first reaction of another gain, not the motion
    that would follow.

    Examples:

      rtctl replay runs/ivu-20250102-101500

      rtctl replay runs/ivu-20250102-101500 --set law.position.gain=40 --plot gain40.png
    """
    from rtctl.trace.replay import replay as play

    found = play(bundle, _changes(set_), own or ())
    if plot is not None:
        _draw(found, plot)
    if json:
        common.print_json(_as_json(found))
    else:
        typer.echo("\n".join(_say(found)))
    if not found.identical and not found.changed:
        raise typer.Exit(1)


def _changes(set_: list[str] | None) -> dict[str, Any]:
    from rtctl.config.errors import UserError
    from rtctl.config.yaml_file import parse

    out = {}
    for text in set_ or []:
        key, equals, value = text.partition("=")
        if not equals:
            raise UserError(f"--set {text}: write key=value, e.g. law.position.gain=20")
        out[key] = parse(value, f"--set {text}").data
    return out


def _as_json(r: "Replayed") -> dict[str, Any]:
    return {
        "bundle": str(r.bundle.folder),
        "ticks": len(r.rows),
        "compared": list(r.compared),
        "written": list(r.written),
        "identical": r.identical,
        "differences": [d._asdict() for d in r.differences],
        "stopped": r.stopped or None,
        "changed": r.changed,
        "same_program": r.same_program,
    }


def _say(r: "Replayed") -> list[str]:
    rest = f"; {r.stopped}" if r.stopped else ""
    if r.identical:
        signals = f"{len(r.compared)} signals"
        if r.changed:
            return [f"{len(r.rows)} ticks: {_set(r)} changes nothing in {signals}{rest}"]
        return [f"{len(r.rows)} ticks, {signals}: identical to the bit{rest}"]
    first = r.differences[0]
    lines = [
        f"{len(r.rows)} ticks: {len(r.differences)} of {len(r.compared)} signals differ, first {first.column} at "
        f"tick {first.tick} ({first.t:g} s): {first.recorded:.9g} was recorded and {first.replayed:.9g} comes out{rest}"
    ]
    ahead = sorted(r.differences, key=lambda d: (d.column not in r.written, d.tick))
    lines += [f"  {d.column:20}{d.ticks} ticks differ, by {d.largest:.3g} at most" for d in ahead[:MOST]]
    if r.changed:
        lines.append(f"with {_set(r)}; the measurements are as recorded")
    elif not r.same_program:
        lines.append("it was recorded by other sources or on another machine: see `versions` in case.json")
    return lines


def _set(r: "Replayed") -> str:
    return " ".join(f"{key}={value}" for key, value in r.changed.items())


def _draw(r: "Replayed", path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from rtctl.trace.plot import save

    count = len(r.written)
    figure = Figure(figsize=(9.0, 2.4 * 2 * count), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2 * count, 1, sharex=True, squeeze=False)[:, 0]
    t = r.rows["t"]
    for i, name in enumerate(r.written):
        above, below = axes[2 * i], axes[2 * i + 1]
        above.plot(t, r.recorded[name], color=PEN["recorded"], lw=1.0, label="recorded")
        above.plot(t, r.rows[name], color=PEN["replayed"], lw=0.8, label=_set(r) or "replayed")
        above.set_ylabel(f"{name} [V]")
        above.legend(loc="upper right", frameon=False)
        below.plot(t, r.rows[name] - r.recorded[name], color=PEN["difference"], lw=0.8)
        below.set_ylabel(f"change of {name} [V]")
    axes[-1].set_xlabel("t [s]")
    save(figure, path)
