"""`rtctl reproduce`: the experiments and designs of the thesis, repeated on the emulated machines."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli.common import JsonOption

app = typer.Typer(add_completion=False)
DOCS = Path("docs")


@app.command()
def reproduce(
    only: Annotated[
        str | None,
        typer.Option("--only", metavar="CHAPTER_OR_NAME", help="One chapter (8), row (8.delay) or figure (8.3)."),
    ] = None,
    short: Annotated[bool, typer.Option("--short", help="Shorter runs, as the tests play them.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="DIR",
            help="Where page and figures go; docs if absent, with --only or --short nowhere.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", metavar="N", min=1, help="Parallel processes; all cores if absent."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Play every experiment and design of the thesis on the emulated machines and write docs/reproduction.md: its
    numbers beside ours, and its figures drawn from our data. Takes minutes; progress is on standard error.

    Exit code 1 where a row fails: it passes or differs other than it says.

    Examples:

      rtctl reproduce

      rtctl reproduce --only 12.bandwidth --json

      rtctl reproduce --only 8 --out /tmp/chapter8
    """
    from rtctl.reproduce import page, run

    which = run.parts(only)
    folder = out if out is not None else None if only or short else DOCS
    check_folder(folder, out is not None)
    cores = jobs or len(os.sched_getaffinity(0))
    typer.echo(f"{len(which)} parts, {min(cores, len(which))} at once", err=True)
    results = run.reproduce(which, short, folder, cores, lambda line: typer.echo(line, err=True))
    rows = [row for result in results for row in result.rows]
    written = None if folder is None else page.write(results, folder)
    if json:
        from rtctl.cli import common

        common.print_json({"rows": [row.as_json() for row in rows]})
    else:
        for row in rows:
            typer.echo(words(row))
        typer.echo(page.summary(rows) + (f" {written}" if written else ""))
    if any(row.verdict == "fail" for row in rows):
        raise typer.Exit(1)


def check_folder(folder: Path | None, given: bool) -> None:
    """Make the output folder. Raises UserError where there is no folder docs here, or the folder cannot be made."""
    from rtctl.config.errors import UserError

    if folder is None:
        return
    if not given and not folder.is_dir():
        raise UserError("there is no folder docs here; say where the page goes: rtctl reproduce --out DIR")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out {folder}: cannot be made: {error.strerror}") from None


def words(row: Any) -> str:
    """Line of text for one row."""
    from rtctl.reproduce import page

    said = "thesis" if row.thesis is not None and not row.erratum else "equations" if row.erratum else "claim"
    mark = {"pass": "ok", "fail": "FAIL"}.get(row.verdict, row.verdict)
    got = row.refused or f"{page.value(row.measured, row.unit)}, {said} {page.value(row.against, row.unit)}"
    return f"{mark:7} {row.name:28} {got}  ({page.tolerance(row)})"
