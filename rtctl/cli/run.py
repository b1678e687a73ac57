"""`rtctl run CONFIG`: run a machine, show how it does, and report on its steps."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, JsonOption, LinkOption, ModeOption, ReferenceOption, SetOption

HUNG_UP = 129  # exit code, 128 + SIGHUP
app = typer.Typer(add_completion=False)


@app.command()
def run(
    config: ConfigArgument,
    mode: ModeOption = None,
    link: LinkOption = None,
    duration: Annotated[
        str | None, typer.Option("--for", metavar="T", help="How long, e.g. 12s; until Ctrl-C if absent.")
    ] = None,
    reference: ReferenceOption = None,
    set_: SetOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder of the bundle; runs/NAME-DATE-TIME if absent."),
    ] = None,
    arm: Annotated[bool, typer.Option(help="Arm at once and play the reference.")] = True,
    plot: Annotated[bool, typer.Option(help="Draw the run into the bundle.")] = True,
    fail_on_loss: Annotated[
        bool, typer.Option("--fail-on-loss", help="Exit code 1 where rows were lost or ticks missed.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Run a machine under control, on a bench or against its emulated twin.

    Exit code 1 where the machine tripped, its loop died, or its recording stopped or was moved. Exit code 129 where the
    terminal was closed: outputs are zero and the recording is complete.

    Examples:

      rtctl run ivu --for 12s --reference steps

      rtctl run ldu.yaml --mode fused --for 3s --json

      rtctl run ivu.yaml --set law.position.gain=20 --set radius.source=measured
    """
    from rtctl.daemon.children import early

    with early(*(() if mode == "fused" else ("plant",)), "loop"):  # they import while this process does
        import structlog

        from rtctl.config.errors import RunFailed, UserError
        from rtctl.config.yaml_file import told
        from rtctl.daemon.session import Session

        def read() -> Any:
            settings = common.load_config(config, set_)
            return common.with_loop(common.with_reference(settings, reference), mode, link)

        settings = read()
        length = common.seconds(duration, "--for")
        folder = out if out is not None else common.default_folder(settings.name)
        console = _console(json)
        structlog.configure(logger_factory=lambda *_: structlog.PrintLogger(console.log))  # stdout is for JSON
        console.say(told(config))
        session = Session(settings, folder, length, arm=arm, say=console.say, reread=read)
        failure = None
        try:
            with console.live():
                result = session.run(console.update)
        except (RunFailed, UserError) as error:
            if session.result is None:
                raise
            failure, result = error, session.result
        except KeyboardInterrupt:
            if not session.supervisor.terminal_gone:
                raise
            raise typer.Exit(HUNG_UP) from None
    if session.supervisor.terminal_gone:
        raise typer.Exit(HUNG_UP)
    if plot:
        result["plot"] = session.draw()
    if json:
        common.print_json(result)
    else:
        console.report(result)
    if failure is not None:
        raise failure
    if result["rows"].get("error"):
        raise typer.Exit(1)
    if result["tripped"] or (fail_on_loss and (result["lost_rows"] or result["missed"])):
        raise typer.Exit(1)


def _console(json: bool) -> Any:
    from rtctl.cli.console import RunConsole

    return RunConsole(quiet=json)
