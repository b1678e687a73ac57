"""`rtctl arm`, `disarm`, `reset`, `play`, `stop`: commands to a running machine without arguments."""

import time
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption, NameOption

app = typer.Typer(add_completion=False)
POLL = 0.01  # s
IN_FORCE = 1.0  # s; longest wait for the tick that carries out a command


@app.command()
def arm(json: JsonOption = False, name: NameOption = None) -> None:
    """Switch the outputs on and hold position. Exit code 1 where the machine trips at once.

    Examples:

      rtctl arm

      rtctl arm --name ldu
    """
    found = _do("arm", json, name)
    if found["trip"]:
        raise typer.Exit(1)


@app.command()
def disarm(json: JsonOption = False, name: NameOption = None) -> None:
    """Switch the outputs off.

    Examples:

      rtctl disarm
    """
    _do("disarm", json, name)


@app.command()
def reset(json: JsonOption = False, name: NameOption = None) -> None:
    """Clear a trip; the machine stays off until it is armed.

    Examples:

      rtctl status && rtctl reset && rtctl arm
    """
    _do("reset", json, name)


@app.command()
def play(json: JsonOption = False, name: NameOption = None) -> None:
    """Play the config's reference from its start.

    Examples:

      rtctl arm && rtctl play
    """
    _do("play", json, name)


@app.command()
def stop(
    wait: Annotated[
        str, typer.Option("--wait", metavar="T", help="How long to wait until the daemon is gone.")
    ] = "60s",
    name: NameOption = None,
) -> None:
    """Switch the outputs off, end the daemon, and wait until its recording is closed.

    Examples:

      rtctl stop

      rtctl stop --name ldu --wait 5min
    """
    from rtctl.config.errors import UserError
    from rtctl.daemon.client import listens

    limit = common.seconds(wait, "--wait") or 0.0
    with common.client(name) as client:
        pid = client.call("ping")["pid"]
        client.call("stop")
        endpoint = client.endpoint
    deadline = time.monotonic() + limit
    while listens(endpoint):
        if time.monotonic() > deadline:
            raise UserError(
                f"outputs are off, but the daemon (pid {pid}) has not ended after {wait}; it may still write"
            )
        time.sleep(POLL)
    typer.echo(f"stopped (pid {pid})")


def _do(op: str, json: bool, name: str | None) -> dict[str, Any]:
    """Status after the command `op`, which is also printed."""
    with common.client(name) as client:
        tick = client.call(op)["tick"]
        found = client.call("status")
        deadline = time.monotonic() + IN_FORCE
        while found["ticks"] <= tick + 2 and time.monotonic() < deadline:
            time.sleep(POLL)
            found = client.call("status")
    if json:
        common.print_json({"name": found["name"], "tick": tick, "state": found["state"], "trip": found["trip"]})
    else:
        typer.echo(f"{found['name']} is {found['state']}" + (f": {found['trip']['why']}" if found["trip"] else ""))
    return found
