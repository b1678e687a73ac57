"""`rtctl soak`: a random day of a machine from a seed, with invariants checked on every tick."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, JsonOption, LinkOption, SetOption
from rtctl.cli.progress import progress

app = typer.Typer(add_completion=False)
MOST_HOURS = 24.0 * 365.0


@app.command()
def soak(
    config: ConfigArgument,
    hours: Annotated[float, typer.Option("--hours", metavar="H", help="Hours of the machine's own time.")],
    seed: Annotated[
        int,
        typer.Option(
            "--seed", metavar="S", min=0, help="Seed of the day; the same seed gives the same day to the bit."
        ),
    ] = 1,
    mode: Annotated[
        str, typer.Option("--mode", metavar="MODE", help="fused, lockstep or real; the last two run a daemon.")
    ] = "fused",
    faults: Annotated[bool, typer.Option("--faults/--no-faults", help="Inject random faults as well.")] = True,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Summary, progress and bundles; runs/soak-NAME-... if absent."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the soak in --out.")] = False,
    junit: Annotated[
        Path | None, typer.Option("--junit", metavar="FILE.xml", help="Write JUnit XML, a test case an invariant.")
    ] = None,
    set_: SetOption = None,
    link: LinkOption = None,
    json: JsonOption = False,
) -> None:
    """Play a random day: references, bursts of setpoints, gain changes, captures, outputs off and on, and faults, all
    drawn from the seed, with invariants checked on every tick. Each violation leaves a bundle of the rows around it.

    Exit code 1 with violations. Ctrl-C ends it between two events, and --resume continues there.

    Examples:

      rtctl soak ivu --hours 24

      rtctl soak configs/ldu.yaml --hours 1 --seed 7 --out /tmp/soak --junit soak.xml --json

      rtctl soak ldu --hours 8 --out /tmp/soak --resume
    """
    from rtctl.config.errors import UserError

    if not 0.0 < hours <= MOST_HOURS:
        raise UserError(f"--hours {hours:g}: more than 0 and at most {MOST_HOURS:g}, a year")
    if resume and out is None:
        raise UserError("--resume needs --out: the folder of the soak to go on with")
    settings = common.with_loop(common.load_config(config, set_), mode, link)
    common.machine_of(settings)
    from rtctl.soak import report
    from rtctl.soak.soak import soak as play

    folder = out or common.default_folder(f"soak-{settings.name}")
    with _stopped() as stopped, progress(settings.name, "violations") as update:
        found = play(settings, hours, seed, faults, folder, resume, update, stopped)
    if junit is not None:
        try:
            report.junit(found, junit)
        except OSError as error:
            raise UserError(f"--junit {junit}: cannot be written: {error.strerror}") from None
    if json:
        common.print_json(found)
    else:
        typer.echo("\n".join(report.words(found)))
    if found["violations"]:
        raise typer.Exit(1)
    if not found["complete"]:
        typer.echo(f"ended early; go on with --resume --out {folder}", err=True)
        raise typer.Exit(130)


@contextlib.contextmanager
def _stopped() -> Iterator[Callable[[], bool]]:
    """Context with a function that is true after Ctrl-C or SIGTERM; a second signal raises KeyboardInterrupt."""
    import signal
    import threading

    asked: list[int] = []

    def note(number: int, _: Any) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(asked)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
