"""`rtctl trend`: parameters of a machine over many recordings, and whether they changed."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption
from rtctl.cli.progress import progress

ALARM = 4  # exit code where a parameter changed; 1 is an internal error
LISTED = 20

app = typer.Typer(add_completion=False)


@app.command()
def trend(
    what: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER...", help="Bundles, or folders of bundles at any depth; of one machine or many."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Table and page; FOLDER/trend if absent. A trend in it is continued."
        ),
    ] = None,
    window: Annotated[
        str, typer.Option("--window", metavar="T", help="Length of a piece of a long recording, e.g. 30s.")
    ] = "60s",
    least: Annotated[
        float, typer.Option("--least", metavar="PERCENT", min=0.0, help="Smallest change that is an alarm.")
    ] = 2.0,
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", metavar="N", min=1, max=256, help="Processes; one a CPU if absent.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="tcp://...", help="Compute on a Dask cluster instead.")
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Fit finished recordings again.")] = False,
    json: JsonOption = False,
) -> None:
    """Fit the machine's parameters to every recording, and report which changed, when, and by how much.

    Writes trend.parquet (every estimate with its interval) and trend.html (pictures by machine, changes marked). Only
    recordings that are new or changed are fitted. Long recordings are fitted piece by piece.

    Exit code 0 without an alarm, 4 with an alarm: a parameter changed by --least or more. 2 for a path that is no
    bundle, 3 where no recording gives an estimate.

    Examples:

      rtctl trend /var/lib/rtctl/runs --out /var/www/trend

      rtctl trend monday tuesday wednesday --least 5 --json

      rtctl trend runs --scheduler tcp://bench2:8786
    """
    from rtctl import workers
    from rtctl.config.errors import UserError
    from rtctl.trend import trend as trends

    length = common.seconds(window, "--window")
    assert length is not None
    folder = out if out is not None else what[0] / "trend"
    if out is None and len(what) > 1:
        raise UserError("--out DIR is missing: with several folders, say where table and page go")
    try:
        with progress(folder.name, "without an estimate") as update:
            found = trends.run(what, folder, jobs or workers.cpus(), scheduler, length, least / 100.0, again, update)
    except workers.PoolError as error:
        typer.echo(f"rtctl: {error}; the same command goes on there", err=True)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        typer.echo("ended early; the same command goes on there", err=True)
        raise typer.Exit(130) from None
    if json:
        common.print_json(found)
    else:
        typer.echo("\n".join(_words(found)))
    if found["errors"]:
        typer.echo(f"rtctl: {len(found['errors'])} recordings give no estimate; see {found['page']}", err=True)
    if found["alarms"]:
        raise typer.Exit(ALARM)


def _words(found: dict[str, Any]) -> list[str]:
    """The summary for a terminal."""
    machines = len(found["machines"])
    lines = [
        f"{found['records']} recordings of {machines} machine{'s' if machines != 1 else ''}, {found['fitted']} fitted "
        f"now, in {found['wall_s']:.1f} s; {found['looked_at']} of {found['series']} numbers looked at"
    ]
    alarms = [change for change in found["changes"] if change["alarm"]]
    for change in alarms[:LISTED]:
        what = change["number"] if change["of"] == "parameter" else f"residual of {change['number']}"
        when = "drifts by" if change["kind"] == "drift" else f"from {change['from']} on by"
        low, high = change["interval"]
        lines.append(
            f"ALARM {change['machine']}: {what} {when} {100 * change['change']:+.3g} % "
            f"({100 * low:+.3g} to {100 * high:+.3g}), probability {100 * min(change['probability'], 0.9999):.4g} %"
        )
    slight = len(found["changes"]) - len(alarms)
    if len(alarms) > LISTED or slight:
        lines.append(f"{max(len(alarms) - LISTED, 0)} more alarms and {slight} slighter changes are on the page")
    if not found["changes"]:
        lines.append("no change")
    return [*lines, found["page"]]
