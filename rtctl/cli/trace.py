"""`rtctl trace`: inspect, draw, compare, export and repair bundles."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption

if TYPE_CHECKING:
    from rtctl.trace.bundle import Bundle

app = typer.Typer(add_completion=False, no_args_is_help=True)
BundleArgument = Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder with recording.parquet and case.json.")]
ColumnsOption = Annotated[
    str | None, typer.Option("--columns", metavar="A,B", help="Columns by name, comma between; all if not given.")
]


@app.callback()
def _trace() -> None:
    """Inspect, draw, compare, export and repair recorded bundles."""


@app.command()
def info(bundle: BundleArgument, json: JsonOption = False) -> None:
    """Print what a bundle holds: length, rate, signals, losses, orders, parts, and the timing of its ticks.

    Examples:

      rtctl trace info runs/ivu-20250102-030405

      rtctl trace info runs/now --json
    """
    from rtctl.trace.bundle import load_bundle

    loaded = load_bundle(bundle)
    found = _describe(loaded)
    if json:
        common.print_json(found)
        return
    for key in ("plant", "rows", "duration_s", "sample_rate_hz", "recorded_at", "complete", "lost_rows", "changes"):
        if found[key] is not None:
            typer.echo(f"{key:16}{found[key]}")
    typer.echo(f"{'columns':16}{', '.join(f'{n} [{u}]' if u else n for n, u in found['columns'].items())}")
    typer.echo(f"{'controller':16}{'known' if found['controller_known'] else 'not known'}")
    for line in _account(found):
        typer.echo(line)


def _describe(loaded: "Bundle") -> dict[str, Any]:
    from rtctl.trace.orders import orders

    t, case = loaded.columns["t"], loaded.case
    span = float(t[-1] - t[0])
    told = orders(loaded.folder)
    parts, timing = case.get("parts"), case.get("timing")
    timing = timing if isinstance(timing, dict) else {}
    return {
        "bundle": str(loaded.folder),
        "plant": case.get("plant") or (case.get("config") or {}).get("name"),
        "rows": len(t),
        "duration_s": round(span, 6),
        "sample_rate_hz": case.get("sample_rate") or (round((len(t) - 1) / span, 3) if span > 0 else None),
        "recorded_at": case.get("recorded_at"),
        "complete": case.get("complete"),
        "lost_rows": case.get("losses", {}).get("rows"),
        "changes": len(case["changes"]) if "changes" in case else None,
        "controller_known": bool(case.get("controller_known")),
        "columns": {name: loaded.units.get(name, "") for name in loaded.columns},
        "orders": len(told),
        "settings_changed": sorted({key for order in told.values() for key in order.changed}),
        "timing_us": {stage: _stage(v) for stage, v in timing.items() if isinstance(v, dict)},
        "parts": [part for part in parts if isinstance(part, dict)] if isinstance(parts, list) else [],
    }


def _stage(account: dict[str, Any]) -> dict[str, Any]:
    return {key: account.get(key) for key in ("count", "p50", "p99", "max")}


def _account(found: dict[str, Any]) -> list[str]:
    """Lines with orders, parts and timing of a recording."""
    lines = []
    if found["orders"]:
        keys = found["settings_changed"]
        lines.append(f"{'orders':16}{found['orders']}" + (f", which changed {', '.join(keys)}" if keys else ""))
    for part in found["parts"]:
        first, last = (part.get("t") or (float("nan"), float("nan")))[:2]
        lines.append(f"{part.get('folder', 'part'):16}{part.get('rows', 0)} rows, {first:g} s to {last:g} s")
    counted = {k: v for k, v in found["timing_us"].items() if v["count"]}
    if counted:
        lines.append(f"{'timing [us]':16}{'p50':>10}{'p99':>10}{'max':>10}{'ticks':>12}")
        for name, v in counted.items():
            lines.append(f"  {name:14}{v['p50']:10.3g}{v['p99']:10.3g}{v['max']:10.3g}{v['count']:12}")
    return lines


@app.command()
def plot(
    bundle: BundleArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="PNG", help="The picture; BUNDLE/run.png if not given.")
    ] = None,
) -> None:
    """Draw a bundle into a PNG and print where it is.

    Examples:

      rtctl trace plot runs/now -o now.png
    """
    from rtctl.config.errors import UserError
    from rtctl.trace.bundle import load_bundle
    from rtctl.trace.plot import plot_run

    path = out or bundle / "run.png"
    try:
        plot_run(load_bundle(bundle), [], path)
    except ValueError as error:
        raise UserError(f"{bundle}: {error}") from error
    typer.echo(path)


@app.command()
def repair(bundle: BundleArgument) -> None:
    """Make a complete bundle from the files of a killed recording. A second repair changes nothing.

    Examples:

      rtctl trace repair runs/ivu-20250102-030405
    """
    from rtctl.config.errors import UserError
    from rtctl.trace.repair import repair as make_whole

    try:
        report = make_whole(bundle)
    except OSError as error:
        raise UserError(f"{bundle}: the disk did not take the repaired recording: {error.strerror or error}") from error
    typer.echo(report)


@app.command()
def recover(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The machine's `name`, as its config has it.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FOLDER",
            help="Present folder of the recording, if it was moved. For rows without a recording a new folder, "
            "NAME-recovered-DATE-TIME if not given.",
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Append the rows that a killed daemon left in shared memory to its recording, after a repair of the recording.

    Shared memory belongs to one user and is lost when the computer restarts. Recovered rows are removed from it.

    Examples:

      rtctl trace recover ivu

      sudo -u rtctl rtctl trace recover ivu -o /var/lib/rtctl/rescued
    """
    from rtctl.config.errors import UserError
    from rtctl.daemon.recover import recover as take

    done, troubles = take(name, out)
    if json:
        found = [{key: str(v) if isinstance(v, Path) else v for key, v in each._asdict().items()} for each in done]
        common.print_json({"recovered": found, "troubles": troubles})
    else:
        for each in done:
            typer.echo(each)
    if troubles:
        raise UserError("\n".join(troubles))


@app.command()
def export(
    bundle: BundleArgument,
    to: Annotated[
        str, typer.Option("--to", metavar="FORMAT", help="csv, mat, parquet, mcap, mcap-json, rrd, mf4 or tdms.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="The file; BUNDLE/trace.* if not given.")
    ] = None,
    columns: ColumnsOption = None,
    start: Annotated[str | None, typer.Option("--from", metavar="TIME", help="From this time of column t on.")] = None,
    end: Annotated[str | None, typer.Option("--to-time", metavar="TIME", help="Until this time of column t.")] = None,
    every: Annotated[
        int, typer.Option("--every", metavar="N", min=1, help="Keep one row in N, without an anti-aliasing filter.")
    ] = 1,
    json: JsonOption = False,
) -> None:
    """Write a bundle as a file for another program and print where it is.

    mcap opens in Foxglove, PlotJuggler and Rerun; layouts are in docs/plotjuggler. rrd, mf4 and tdms need the extra of
    that name.
    The column t is always written.

    Examples:

      rtctl trace export runs/now --to mcap -o now.mcap

      rtctl trace export runs/now --to csv --columns ref,capstan,u1 --from 2s --to-time 4s

      rtctl trace export runs/soak --to mat --every 10
    """
    from rtctl.trace.export import Selection
    from rtctl.trace.export import export as write

    selection = Selection(
        _words(columns), _moment(start, "--from", float("-inf")), _moment(end, "--to-time", float("inf")), every
    )
    done = write(bundle, to, out, selection)
    if json:
        common.print_json({**done._asdict(), "path": str(done.path)})
    else:
        typer.echo(done.path)


@app.command()
def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="A bundle.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Another of the same machine.")],
    columns: ColumnsOption = None,
    align: Annotated[
        str, typer.Option("--align", metavar="BY", help="tick, reference (where it starts to move) or auto.")
    ] = "auto",
    plot: Annotated[Path | None, typer.Option("--plot", metavar="PNG", help="Draw both and B - A.")] = None,
    same: Annotated[bool, typer.Option("--same", help="Exit code 1 unless they are the same to the bit.")] = False,
    json: JsonOption = False,
) -> None:
    """Compare two recordings of one machine: each signal's difference, the first tick that differs, the steps.

    Examples:

      rtctl trace compare runs/before runs/after

      rtctl trace compare runs/a runs/b --columns u1,u2,capstan --plot ab.png

      rtctl trace compare runs/first runs/again --same
    """
    from rtctl.cli.trace_compare import draw, say
    from rtctl.config.errors import UserError
    from rtctl.trace.compare import as_dict
    from rtctl.trace.compare import compare as lay

    if align not in ("auto", "tick", "reference"):
        raise UserError(f"--align {align}: it is auto, tick or reference")
    found = lay(a, b, _words(columns), align)  # type: ignore[arg-type]
    if plot is not None:
        draw(found, plot, chosen=bool(columns))
    if json:
        common.print_json(as_dict(found))
    else:
        typer.echo("\n".join(say(found)))
    if same and not found.same:
        raise typer.Exit(1)


def _words(columns: str | None) -> tuple[str, ...]:
    return tuple(word.strip() for word in (columns or "").split(",") if word.strip())


def _moment(text: str | None, option: str, otherwise: float) -> float:
    """Time of the column t, the controller's clock, in s; it may be 0 or negative."""
    if text is None:
        return otherwise
    try:
        return float(text)
    except ValueError:
        minus, size = text.startswith("-"), text.removeprefix("-")
    if size.strip("0.") in common.SECONDS:
        return 0.0
    return (-1.0 if minus else 1.0) * (common.seconds(size, option) or 0.0)
