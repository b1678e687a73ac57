"""`rtctl campaign`: one config run many times over a matrix of settings, and its results."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common, complete
from rtctl.cli.common import JsonOption
from rtctl.cli.progress import progress

app = typer.Typer(add_completion=False, no_args_is_help=True)


@app.callback()
def _campaign() -> None:
    """Run a config many times over a matrix of settings, and judge the results."""


@app.command()
def run(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="Campaign file, one that comes with rtctl (radii_10000), or a machine's config: one run.",
            autocompletion=complete.campaigns,
        ),
    ],
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", metavar="N", min=1, max=256, help="Processes; one for each CPU if absent."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="tcp://...", help="Compute on a Dask cluster instead.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Results; runs/NAME-... if absent. A campaign in it is continued."
        ),
    ] = None,
    for_: Annotated[
        str | None, typer.Option("--for", metavar="TIME", help="Length of a run, instead of `seconds`; e.g. 12s.")
    ] = None,
    fail_on: Annotated[
        list[str] | None,
        typer.Option(
            "--fail-on", metavar="EXPR", help="Exit 1 where this holds: 'final_error_mm.p99 > 0.1'. Repeatable."
        ),
    ] = None,
    baseline: Annotated[
        Path | None, typer.Option("--baseline", metavar="DIR", help="An earlier campaign to compare with.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Run every cell of a campaign's matrix on virtual time: one table (results.parquet) and a report of all.

    Exit code 1 where runs failed or a --fail-on holds. Ctrl-C keeps the finished runs; the same command with --out
    continues there.

    Examples:

      rtctl campaign run radii_10000 --out runs/radii

      rtctl campaign run gains.yaml --fail-on 'final_error_mm.p99 > 0.1' --fail-on 'trip.count > 0'

      rtctl campaign run gains.yaml --scheduler tcp://bench2:8786 --baseline runs/gains-before --json
    """
    from rtctl.campaign import conditions
    from rtctl.campaign.plan import load_plan

    plan = load_plan(file, common.load_config, common.seconds(for_, "--for"))
    given = [conditions.parse(text, plan.metrics) for text in fail_on or []]
    if baseline is None and any(c.metric == conditions.REGRESSIONS for c in given):
        from rtctl.config.errors import UserError

        raise UserError("--fail-on regressions: they are against an earlier campaign; name it with --baseline DIR")
    from rtctl import workers
    from rtctl.campaign import campaign

    folder = out or common.default_folder(plan.name)
    try:
        with progress(plan.name, "failed") as update:
            found = campaign.run(plan, folder, jobs or workers.cpus(), scheduler, given, baseline, update)
    except workers.PoolError as error:
        typer.echo(f"rtctl: {error}; go on with --out {folder}", err=True)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        typer.echo(f"ended early; go on with --out {folder}", err=True)
        raise typer.Exit(130) from None
    if json:
        common.print_json(found)
    else:
        typer.echo("\n".join(_words(found)))
    fails = [judged["words"] for judged in found["fail_on"] if judged["failed"]]
    for words in fails:
        typer.echo(f"rtctl: {words}", err=True)
    if found["failed"]:
        typer.echo(f"rtctl: {found['failed']} of {found['runs']} runs failed; rtctl campaign list {folder}", err=True)
    if fails or found["failed"]:
        raise typer.Exit(1)


@app.command(name="list")
def list_(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a campaign that was run.")],
    worst: Annotated[int, typer.Option("--worst", metavar="K", min=0, help="How many of the worst runs.")] = 10,
    by: Annotated[
        str | None,
        typer.Option("--by", metavar="METRIC", help="Metric that ranks the runs; that of the campaign if absent."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """List the runs of a campaign that failed, and the worst of the others.

    Examples:

      rtctl campaign list runs/radii

      rtctl campaign list runs/radii --worst 3 --by tension_min_N --json
    """
    from rtctl.campaign.listing import listing, words
    from rtctl.campaign.store import load_results

    plan, table = load_results(folder)
    found = listing(plan, table, folder, worst, by)
    if json:
        common.print_json(found)
    else:
        typer.echo("\n".join(words(found)))


def _words(found: dict[str, Any]) -> list[str]:
    """The summary for a terminal."""
    lines = [f"{found['runs']} runs of {found['campaign']} in {found['wall_s']:.1f} s, {found['failed']} failed"]
    if found["computed"] < found["runs"]:
        lines[0] += f"; {found['runs'] - found['computed']} of them were there already"
    lines.append(f"{'':22}{'min':>11}{'median':>11}{'p99':>11}{'max':>11}")
    for name, s in found["metrics"].items():
        if s["count"]:
            lines.append(f"{name:22}" + "".join(f"{s[key]:11.4g}" for key in ("min", "median", "p99", "max")))
    if "baseline" in found:
        b = found["baseline"]
        against = f"against {b['folder']}, of which {b['matched']} runs match"
        lines.append(f"{b['regressions']} regressions, {b['better']} improvements {against}")
    return [*lines, found["report"]]
