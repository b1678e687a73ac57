"""`rtctl diagnose`: find the physics that a simulation lacks, in one recording, in many, or on a running machine."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption, ModeOption, ReferenceOption, SetOption

if TYPE_CHECKING:
    from rtctl.diagnose.answer.repair import Repair

app = typer.Typer(add_completion=False)


@app.command()
def diagnose(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="BUNDLE...",
            help="Folder with recording.parquet and case.json, or a folder of such folders; several are recordings of "
            "one machine; with --closed-loop a CONFIG.",
        ),
    ],
    heldout: Annotated[
        Path | None,
        typer.Option("--heldout", metavar="BUNDLE2", help="A second recording of the same machine, to be predicted."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Where the results go; BUNDLE/diagnosis if absent."),
    ] = None,
    json: JsonOption = False,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="With a folder: parallel processes; one a core if absent.")
    ] = None,
    limit: Annotated[
        str, typer.Option("--limit", metavar="T", help="With a folder: time limit for a bundle, e.g. 600s.")
    ] = "600s",
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="tcp://...", help="With a folder: use the workers of a Dask scheduler."),
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="With a folder: repeat finished diagnoses.")] = False,
    together: Annotated[
        bool,
        typer.Option(
            "--together",
            help="The bundles, or all in the folder, are of one machine: one verdict.",
        ),
    ] = False,
    terms: Annotated[
        list[str] | None,
        typer.Option(
            "--term", metavar="FILE:NAME", help="A term of your own, ./windage.py:Windage, to be tried as well."
        ),
    ] = None,
    mechanics: Annotated[
        str | None,
        typer.Option("--mechanics", metavar="FILE", help="Your file with the machine's M(q) and h(q, v): ./furuta.py."),
    ] = None,
    machine: Annotated[
        Path | None,
        typer.Option(
            "--machine", metavar="YAML", help="Your config that names a file for --mechanics; only that key is used."
        ),
    ] = None,
    closed_loop: Annotated[
        bool, typer.Option("--closed-loop", help="Record the machine of a CONFIG, diagnose it, write its model.")
    ] = False,
    duration: Annotated[
        str | None, typer.Option("--for", metavar="T", help="With --closed-loop: length of a recording, e.g. 25s.")
    ] = None,
    reference: ReferenceOption = None,
    mode: ModeOption = None,
    set_: SetOption = None,
) -> None:
    """Diagnose a recording: which physics does the nominal model lack, where, and how large is it?

    Writes diagnosis.json, model.yaml (for `rtctl run`, `rtctl plant` and `rtctl simulate`) and report.html. Where two
    answers remain, it also writes experiment.yaml, an experiment that tells them apart. In a folder of bundles,
    finished diagnoses are skipped, and NAME-heldout is the second recording of NAME.

    Several bundles count as one machine where their cases name one `group`, or with --together. They get one verdict,
    written into the first bundle. Parameters and effects are shared; initial state and noise belong to each recording.

    With --closed-loop the machine is recorded first. Where two answers remain, the experiment is run and diagnosed as
    well. An emulated machine runs on virtual time.

    Exit code 0 for any verdict, 2 for an invalid bundle, 3 for a bundle that supports no verdict.

    Examples:

      rtctl diagnose runs/ivu-20250102-101500

      rtctl diagnose monday --heldout tuesday --out /tmp/d --json

      rtctl diagnose runs/ivu-20250102-101500 --term ./windage.py:Windage

      rtctl diagnose bench --mechanics ./furuta.py

      rtctl diagnose recordings --jobs 2 --no-report

      rtctl diagnose recordings --scheduler tcp://bench2:8786

      rtctl diagnose turns-left turns-right --together

      rtctl diagnose --closed-loop ivu --for 25s --reference constant_speed
    """
    from rtctl.cli.diagnose_console import DiagnoseConsole

    console = DiagnoseConsole(json)
    _register(terms or [])
    _couple(mechanics, machine)
    if closed_loop:
        if heldout is not None:
            _refuse("--heldout", "goes with a BUNDLE, not with --closed-loop")
        if len(what) > 1 or together:
            _refuse("--closed-loop", "takes one CONFIG")
        _machine(console, what[0], set_, mode, reference, common.seconds(duration, "--for"), out, report, json)
        return
    alone = {"--for": duration, "--reference": reference, "--mode": mode, "--set": set_}
    for option, given in alone.items():
        if given is not None:
            _refuse(option, "goes with --closed-loop CONFIG")

    from rtctl.diagnose.folder import tasks

    bundle = Path(what[0])
    found = tasks(bundle, out, heldout) if len(what) == 1 else []
    if together or len(what) > 1:
        from rtctl.diagnose.bundles import of_one_machine

        if heldout is not None:
            _refuse("--heldout", "goes with one BUNDLE; of several the last part of each is held out")
        bundles = [task.bundle for task in found] or [Path(one) for one in what]
        of_one_machine(bundles, together)
        _bundle(console, bundles[0], None, out, report, json, bundles[1:])
    elif found:
        if terms:
            _refuse("--term", "goes with one bundle, not with a folder of them")
        if mechanics is not None or machine is not None:
            _refuse("--mechanics and --machine", "go with one bundle, not with a folder of them")
        length = common.seconds(limit, "--limit")
        assert length is not None
        _folder(console, found, jobs, length, report, again, json, scheduler)
    else:
        if scheduler is not None:
            _refuse("--scheduler", "goes with a folder of bundles")
        _bundle(console, bundle, heldout, out, report, json)


def _register(terms: list[str]) -> None:
    """Add the terms in the user's files to the library."""
    from rtctl.config.errors import UserError
    from rtctl.own.files import OwnError
    from rtctl.own.term import register_file

    for word in terms:
        try:
            register_file(word, Path())
        except OwnError as error:
            raise UserError(f"--term {word}: {error}") from error


def _couple(mechanics: str | None, machine: Path | None) -> None:
    """Load the mechanics file that the user names; a file that a bundle names is not loaded."""
    if mechanics is not None or machine is not None:
        from rtctl.own.mechanics import give, give_machine

        if machine is not None:
            give_machine(machine)
        if mechanics is not None:
            give(mechanics)


def _refuse(option: str, why: str) -> None:
    from rtctl.config.errors import UserError

    raise UserError(f"{option} {why}; see rtctl diagnose --help")


def _bundle(
    console: Any,
    bundle: Path,
    other: Path | None,
    out: Path | None,
    report: bool,
    json: bool,
    more: Sequence[Path] = (),
) -> None:
    from rtctl.diagnose.answer.results import FOLDER
    from rtctl.diagnose.bundles import diagnose_into

    folder = out if out is not None else bundle / FOLDER
    with console.stages() as stage:
        made = diagnose_into(bundle, other, folder, report, bundle if out is None else None, stage, more)
    console.notes([*made.data["warnings"], *made.faults])
    if json:
        common.print_json(made.data)
    else:
        console.result(made.diagnosis, folder)


def _folder(
    console: Any,
    found: list[Any],
    jobs: int | None,
    limit: float,
    report: bool,
    again: bool,
    json: bool,
    scheduler: str | None,
) -> None:
    import os
    import time

    from rtctl.diagnose.elsewhere import diagnose_elsewhere
    from rtctl.diagnose.folder import BAD, OURS, diagnose_all, done

    began = time.monotonic()
    jobs = jobs or len(os.sched_getaffinity(0))
    before = [] if again else [o for o in map(done, found) if o is not None]
    names = {o.name for o in before}
    outcomes = list(before)
    with console.many(len(found)) as show:
        for outcome in before:
            show(outcome)
        left = [t for t in found if t.name not in names]
        if scheduler is None or not left:
            coming = diagnose_all(left, jobs, limit, report)
        else:
            coming = diagnose_elsewhere(left, scheduler, limit, report)
        for outcome in coming:
            outcomes.append(outcome)
            show(outcome)
    outcomes.sort(key=lambda o: o.name)
    if json:
        common.print_json({"bundles": {o.name: o.as_json() for o in outcomes}})
    else:
        console.summary(outcomes, time.monotonic() - began)
    codes = {o.code for o in outcomes}
    code = OURS if OURS in codes else BAD if BAD in codes else max(codes)
    if code:
        raise typer.Exit(code)


def _machine(
    console: Any,
    what: str,
    set_: list[str] | None,
    mode: str | None,
    reference: str | None,
    length: float | None,
    out: Path | None,
    report: bool,
    json: bool,
) -> None:
    from rtctl.diagnose.answer import files as results
    from rtctl.diagnose.answer import repair
    from rtctl.diagnose.answer.results import finite
    from rtctl.own import files

    config = common.with_loop(common.with_reference(common.load_config(what, set_), reference), mode, None)
    files.refuse_plant(config, f"{what}: ")
    config = repair.ready(config, mode)
    folder = out if out is not None else common.default_folder(config.name)
    with console.stages() as stage:
        made = repair.repair(config, folder, length, stage)
        stage("writing the results")
        faults = results.write(made.last, folder, report)
    rows = results.changes(made.last)
    console.notes([*made.last.record.case.warnings, *faults])
    if json:
        common.print_json(finite(_repaired(made, made.last.as_json(), rows)))
    else:
        console.repaired(made, folder, rows)


def _repaired(made: "Repair", data: dict[str, Any], rows: list[tuple[str, str, str]]) -> dict[str, Any]:
    return {
        **data,
        "bundles": [str(bundle) for bundle in made.bundles],
        "verdicts": [d.verdict for d in made.diagnoses],
        "trips": list(made.trips),
        "changes": [dict(zip(("key", "was", "is"), row, strict=True)) for row in rows],
    }
