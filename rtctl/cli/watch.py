"""`rtctl watch`: run the model beside a running machine and report departures."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common, complete

app = typer.Typer(add_completion=False)


@app.command()
def watch(
    machine: Annotated[
        str | None,
        typer.Argument(
            metavar="[CONFIG|NAME|BUNDLE]",
            help="The machine's `name`, or its config file, where several run; or the folder of a recording.",
            autocompletion=complete.machines,
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model", metavar="YAML", help="A model in place of the config's, as `rtctl diagnose` writes it."
        ),
    ] = None,
    band: Annotated[
        Path | None,
        typer.Option("--band", metavar="FILE", help="Band of the healthy machine: read if it is there, else written."),
    ] = None,
    learn: Annotated[
        str, typer.Option("--learn", metavar="T", help="Time in motion from which the band is learned.")
    ] = "10min",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="DIR", help="Folder for captures of alarms; runs if absent.")
    ] = None,
    diagnose: Annotated[bool, typer.Option(help="Diagnose the capture of an alarm, at the lowest priority.")] = True,
) -> None:
    """Run the model beside a running machine and report when the machine departs from it, until Ctrl-C.

    First the watch learns the residual of the healthy machine. Then a test with at most one false alarm in eight hours
    of motion judges each second. An alarm is captured with the ten seconds before it and diagnosed in the background.
    Alarms appear here, in `rtctl status`, on the scope, in the daemon's log and in Prometheus.

    The watch reads the rows of a machine on this computer and of this user, and cannot delay the loop. For a recording
    it judges all rows, in bounded memory; exit code 1 where the machine departs from its model.

    Examples:

      rtctl watch

      rtctl watch ivu --band ivu.band.json

      rtctl watch ivu.yaml --model runs/ivu-20250102-101500/diagnosis/model.yaml

      rtctl watch runs/monday --band ivu.band.json
    """
    seconds = common.seconds(learn, "--learn")
    assert seconds is not None
    if machine is not None and Path(machine).is_dir():
        from rtctl.watch.recorded import watch_bundle

        if watch_bundle(Path(machine), typer.echo, model, band, seconds):
            raise typer.Exit(1)
        return
    from rtctl.watch.watch import Watch

    with common.client(_name(machine)) as client:
        found = common.first_status(client)
        if found["mode"] != "real":
            from rtctl.config.errors import UserError

            raise UserError(
                f"{found['name']} runs in mode {found['mode']}; watch is for a machine on the wall clock (--mode real)"
            )
        typer.echo(f"{found['name']}: the model runs beside it")
        running = Watch(client, typer.echo, model, band, seconds, out, diagnose)
        if machine is not None and _is_file(machine):
            _compare(machine, running.source.case, running.say)
        running.run()


def _is_file(machine: str) -> bool:
    return machine.endswith((".yaml", ".yml"))


def _name(machine: str | None) -> str | None:
    """The name of the machine to watch."""
    if machine is None or not _is_file(machine):
        return machine
    return str(common.load_config(machine, None).name)


def _compare(file: str, case: dict[str, Any], say: Any) -> None:
    """Report the sections in which the running machine's config differs from a config file."""
    mine = common.load_config(file, None).model_dump(mode="json", exclude_unset=True)
    theirs = case.get("config") or {}
    for key in ("plant", "machine", "loop", "law"):
        if mine.get(key) != theirs.get(key):
            say(f"the machine does not run with `{key}` as {file} has it; the model is that of the running machine")
