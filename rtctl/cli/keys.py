"""`rtctl keys new`: CURVE keys for commands and links that leave this computer."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False, help="Keys for sockets that leave this computer.", no_args_is_help=True)


@app.callback()
def _keys() -> None:
    """Keys for sockets that leave this computer (see docs/protocol.md)."""


@app.command()
def new(
    name: Annotated[str, typer.Argument(metavar="[NAME]", help="`server` for a daemon, else a client.")] = "server",
    directory: Annotated[
        Path | None, typer.Option("--dir", metavar="DIR", help="Folder of the keys; ~/.config/rtctl/keys if not given.")
    ] = None,
) -> None:
    """Make a pair of keys: NAME.key to give away and NAME.key_secret to keep.

    Examples:

      rtctl keys new

      rtctl keys new client --dir ~/keys
    """
    from rtctl.daemon.keys import new_keys

    public, secret = new_keys(name, directory)
    typer.echo(f"{public} (public)\n{secret} (secret: keep it)")
    if name == "server":
        typer.echo(f"copy each client's public key to {public.parent / 'authorized'}, and {public.name} to each client")
    else:
        typer.echo(f"copy {public.name} to the daemon's folder `authorized`, and its server.key to {public.parent}")
