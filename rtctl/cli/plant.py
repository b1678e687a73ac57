"""`rtctl plant CONFIG`: the emulated machine by itself, for a loop on this computer or another."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common, complete
from rtctl.cli.common import ModeOption, SetOption

app = typer.Typer(add_completion=False)


@app.command()
def plant(
    config: Annotated[
        str | None,
        typer.Argument(
            metavar="CONFIG",
            help="Config file, or the name of one that comes with rtctl: ivu, ldu, axis.",
            autocompletion=complete.configs,
        ),
    ] = None,
    endpoint: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT", help="Where to listen; the config's link.endpoint, or a local socket, if not given."
        ),
    ] = None,
    mode: ModeOption = None,
    set_: SetOption = None,
    conceal: Annotated[
        int | None,
        typer.Option(metavar="SEED", min=0, help="Hide an effect in the machine, drawn by this seed; needs --seal."),
    ] = None,
    seal: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The only file into which the hidden effect is written.")
    ] = None,
    after: Annotated[
        str | None,
        typer.Option("--after", metavar="T", help="With --conceal: time from the plant's start to the effect's onset."),
    ] = None,
    open_seal: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Check a seal, print what was hidden, and stop.")
    ] = None,
) -> None:
    """Emulate a machine until Ctrl-C, or serve the real board or the FMU that the config names.

    The config of its loop needs `link: {plant: external, endpoint: ...}`. With --conceal the machine has one effect
    more than its config says; the loop and its recording do not contain which.

    Examples:

      rtctl plant ivu --endpoint tcp://127.0.0.1:5570

      rtctl run ivu --set link.plant=external --set link.endpoint=tcp://127.0.0.1:5570

      rtctl plant ivu --conceal 7 --seal hidden.json

      rtctl plant ivu --conceal 7 --seal hidden.json --after 20min

      rtctl plant --open-seal hidden.json
    """
    from rtctl.config.errors import UserError

    if open_seal is not None:
        _open(open_seal)
        return
    if config is None:
        raise UserError("missing argument 'CONFIG'; see rtctl plant --help")
    if (conceal is None) != (seal is None):
        raise UserError("--conceal SEED and --seal FILE go together: what is hidden is written into the file only")
    onset = common.seconds(after, "--after")
    if onset is not None and conceal is None:
        raise UserError("--after is the time at which the effect of --conceal begins; give --conceal and --seal too")
    settings = common.with_loop(common.load_config(config, set_), mode, "zmq")
    if onset is not None and settings.loop.mode != "real":
        raise UserError("--after counts on the wall clock; use it with --mode real")
    if settings.loop.mode == "fused":
        raise UserError("a fused run has its plant inside; use --mode real or --mode lockstep")
    machine = common.machine_of(settings)
    from rtctl.machines import emulated

    if conceal is not None and not emulated(settings):
        raise UserError("--conceal: an effect is hidden in the emulator; this plant is a real board or an FMU")
    later = None
    if conceal is not None and seal is not None:
        hidden = _hide(settings, conceal, seal)
        machine, later = (hidden, None) if onset is None else (machine, (hidden, onset))

    from rtctl.daemon.notify import from_environment
    from rtctl.daemon.plant_process import alone
    from rtctl.daemon.server import runtime_dir
    from rtctl.drivers.board import BoardError
    from rtctl.loop import generate

    where = endpoint or settings.link.endpoint or f"ipc://{runtime_dir() / f'{settings.name}.plant'}"
    if emulated(settings) and not generate.is_warm(generate.write(machine, "zmq"), f"plant_{settings.loop.mode}"):
        typer.echo("compiling the plant, once for this config structure ...", err=True)
    service = from_environment()

    def announce() -> None:
        typer.echo(f"{settings.name}: plant listens at {where}")
        service.ready(f"listens at {where}")

    try:
        alone(machine, where, announce, later)
    except BoardError as error:
        typer.echo(f"rtctl: {error}; its outputs are off", err=True)
        raise typer.Exit(1) from error
    service.stopping()


def _hide(settings: Any, seed: int, seal: Path) -> Any:
    """Machine with a hidden effect, which is written into the file `seal` only."""
    from rtctl import machines
    from rtctl.diagnose.conceal import conceal
    from rtctl.diagnose.seal import close_seal

    hidden, entry = conceal(settings, seed)
    answer = {"name": settings.name, "plant": settings.kind, "seed": seed, "physics": [entry]}
    typer.echo(f"{settings.name}: sealed in {seal}, sha256 {close_seal(seal, answer)}", err=True)
    return machines.build(hidden)


def _open(path: Path) -> None:
    from rtctl.diagnose.seal import open_seal

    answer, digest = open_seal(path)
    typer.echo(f"{answer['name']} ({answer['plant']}), seed {answer['seed']}, sha256 {digest}: as it was sealed")
    for entry in answer["physics"]:
        first = ("term", "node", *(key for key in entry if key not in ("term", "node")))
        typer.echo(f"- {{{', '.join(f'{key}: {entry[key]}' for key in first)}}}")
