"""`rtctl trace`: look at a bundle, draw it, make it whole."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption

app = typer.Typer(add_completion=False, no_args_is_help=True)
BundleArgument = Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder with recording.parquet and case.json.")]


@app.callback()
def _trace() -> None:
    """Look at a recorded bundle, draw it, or make it whole."""


@app.command()
def info(bundle: BundleArgument, json: JsonOption = False) -> None:
    """Say what a bundle holds: length, rate, signals, losses.

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


def _describe(loaded: Any) -> dict[str, Any]:
    t, case = loaded.columns["t"], loaded.case
    span = float(t[-1] - t[0])
    return {
        "bundle": str(loaded.folder),
        "plant": case.get("plant"),
        "rows": len(t),
        "duration_s": round(span, 6),
        "sample_rate_hz": case.get("sample_rate") or (round((len(t) - 1) / span, 3) if span > 0 else None),
        "recorded_at": case.get("recorded_at"),
        "complete": case.get("complete"),
        "lost_rows": case.get("losses", {}).get("rows"),
        "changes": len(case["changes"]) if "changes" in case else None,
        "controller_known": bool(case.get("controller_known")),
        "columns": {name: loaded.units.get(name, "") for name in loaded.columns},
    }


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
    except OSError as error:
        raise UserError(f"{path}: cannot write the picture: {error.strerror or error}") from error
    typer.echo(path)


@app.command()
def repair(bundle: BundleArgument) -> None:
    """Make a bundle of what a killed recording left behind. Doing it again changes nothing.

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
