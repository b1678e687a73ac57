"""`rtctl plant CONFIG`: the emulated machine by itself, for a loop on this computer or another."""

from typing import Annotated

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, ModeOption, SetOption

app = typer.Typer(add_completion=False)


@app.command()
def plant(
    config: ConfigArgument,
    endpoint: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT", help="Where to listen; the config's link.endpoint, or a local socket, if not given."
        ),
    ] = None,
    mode: ModeOption = None,
    set_: SetOption = None,
) -> None:
    """Emulate a machine until Ctrl-C.

    The loop that drives it has `link: {plant: external, endpoint: ...}` in its config.

    Examples:

      rtctl plant ivu --endpoint tcp://127.0.0.1:5570

      rtctl run ivu --set link.plant=external --set link.endpoint=tcp://127.0.0.1:5570
    """
    from rtctl.config.errors import UserError

    settings = common.with_loop(common.load_config(config, set_), mode, "zmq")
    if settings.loop.mode == "fused":
        raise UserError("a fused run has its plant inside; use --mode real or --mode lockstep")
    machine = common.machine_of(settings)

    from rtctl.daemon.plant_process import alone
    from rtctl.daemon.server import runtime_dir
    from rtctl.loop import generate

    where = endpoint or settings.link.endpoint or f"ipc://{runtime_dir() / f'{settings.name}.plant'}"
    if not generate.is_warm(generate.write(machine, "zmq"), f"plant_{settings.loop.mode}"):
        typer.echo("compiling the plant, once for this config structure ...", err=True)
    alone(machine, where, lambda: typer.echo(f"{settings.name}: plant listens at {where}"))
