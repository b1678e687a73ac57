"""`rtctl simulate MODEL BUNDLE`: simulate any recording with any model and print the errors."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtctl.diagnose.answer.comparison import Comparison

app = typer.Typer(add_completion=False)
OWNER = "case"  # the MODEL that means the recording's nominal model
PEN = {"recorded": "#222222", "simulated": "#0b62a8", "error": "#b3262e"}
MOST_POINTS = 6000  # points of a line in the plot, about


@app.command()
def simulate(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="Config file, the name of one that comes with rtctl, or `case`: the recording's nominal model.",
        ),
    ],
    bundle: Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder with recording.parquet and case.json.")],
    closed: Annotated[
        bool | None,
        typer.Option(
            "--closed-loop/--open-loop",
            help="Input: the reference through the recording's law, or the recorded command; closed where the law is "
            "known.",
        ),
    ] = None,
    skip: Annotated[int, typer.Option("--skip", metavar="N", min=0, help="Rows at the start that do not count.")] = 0,
    own: Annotated[
        list[Path] | None,
        typer.Option(
            "--own", metavar="FILE", help="Your file that the recording used, by path; its text must be unchanged."
        ),
    ] = None,
    json: JsonOption = False,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Draw recorded, simulated and error into a PNG.")
    ] = None,
) -> None:
    """Free run of a model on a recording: the `plant` section of any config, with its `physics` list.

    For a recording of rtctl the tick of its own config closes the loop. Where the law is a file of your own, give it
    with --own; without it the recorded command is the input. Exit code 3 where the model diverges.

    Examples:

      rtctl simulate model.yaml runs/ivu-20250102-101500

      rtctl simulate case emps --closed-loop --skip 20 --json
    """
    from rtctl.case.laws import INPUT
    from rtctl.diagnose.answer.believe import check_believed
    from rtctl.diagnose.answer.freerun import compare
    from rtctl.diagnose.answer.load import of_bundle
    from rtctl.own.files import give
    from rtctl.trace.bundle import load_bundle

    give(own or ())
    whole = load_bundle(bundle)
    record = of_bundle(whole, None if model == OWNER else model)
    if model == OWNER:
        check_believed(record)
    result = compare(record, closed, skip, whole)
    if not json:
        for warning in record.case.warnings:
            if not (result.closed and INPUT in warning):
                typer.echo(f"note: {warning}", err=True)
    if plot is not None:
        from rtctl.trace.plot import save

        save(figure(result), plot)
    if json:
        common.print_json(result.as_json())
    else:
        typer.echo("\n".join(_table(result)))


def _table(result: "Comparison") -> list[str]:
    width = max(map(len, result.channels)) + 2
    rows = len(result.t)
    lines = [f"{result.mode}, {rows} rows" + (f", the first {result.skipped} skipped" if result.skipped else "")]
    lines.append(f"{'':{width}}{'rmse':>12} {'':8}{'nrmse':>10}")
    for name, channel in result.channels.items():
        lines.append(f"{name:{width}}{channel.rmse:12.6g} {channel.unit:8}{channel.nrmse:10.4g}")
    return lines


def figure(result: "Comparison") -> "Figure":
    """Figure with the recorded values, simulated values and error of every channel."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(result.channels)
    made = Figure(figsize=(11, 1.0 + 2.4 * count), dpi=110, layout="constrained")
    FigureCanvasAgg(made)
    panels = made.subplots(2 * count, 1, sharex=True, squeeze=False, height_ratios=[2, 1] * count)[:, 0]
    every = max(1, len(result.t) // MOST_POINTS)
    t = result.t[::every]
    for i, (name, channel) in enumerate(result.channels.items()):
        above, below = panels[2 * i], panels[2 * i + 1]
        above.plot(t, channel.recorded[::every], color=PEN["recorded"], linewidth=1.0, label="recorded")
        above.plot(t, channel.simulated[::every], color=PEN["simulated"], linewidth=0.8, label="simulated")
        error = (channel.simulated - channel.recorded)[::every]
        below.plot(t, error, color=PEN["error"], linewidth=0.8)
        above.set_ylabel(f"{name}\n[{channel.unit}]")
        below.set_ylabel("error")
        above.set_title(f"rmse {channel.rmse:.4g} {channel.unit}, {100 * channel.nrmse:.3g} %", loc="right", fontsize=9)
        for axes in (above, below):
            axes.grid(alpha=0.3)
    panels[0].legend(loc="upper left", fontsize=9, ncols=2)
    panels[0].set_title(f"Free run, {result.mode}", loc="left", fontsize=12, fontweight="bold")
    panels[-1].set_xlabel("time [s]")
    return made
