"""`rtctl scope`: a running machine on a page in the browser."""

from typing import Annotated

import typer

from rtctl.cli import common

app = typer.Typer(add_completion=False)
PORT = 8642


@app.command()
def scope(
    machine: Annotated[
        str | None, typer.Argument(metavar="[MACHINE]", help="The machine's `name`, where several run.")
    ] = None,
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="Port on loopback; 0 takes any.")] = PORT,
    control: Annotated[
        bool, typer.Option("--control", help="Let the page arm, disarm, reset, and change setpoint and settings.")
    ] = False,
) -> None:
    """Serve a page with live traces, trigger, spectrum and state of a running machine, until Ctrl-C.

    It listens on 127.0.0.1 only, and the page can change nothing unless --control is given. From another computer:
    ssh -L 8642:127.0.0.1:8642 HOST.

    Examples:

      rtctl scope

      rtctl scope ldu --port 8700

      rtctl scope ivu --control
    """
    import asyncio

    from rtctl.config.errors import UserError
    from rtctl.scope.feed import Feed
    from rtctl.scope.guard import Guard
    from rtctl.scope.server import Scope

    if machine is not None and "://" in machine:
        raise UserError(f"scope {machine}: give the machine's name; to look from afar, forward the page's port by ssh")
    with common.client(machine) as client:
        name = client.call("status")["name"]
    feed = Feed(name)
    try:
        asyncio.run(Scope(feed, Guard(), control).serve(port, _say))
    finally:
        feed.close()


def _say(scope: object) -> None:
    how = "with control" if scope.control else "read-only"  # type: ignore[attr-defined]
    typer.echo(f"{scope.feed.name}, {how}: {scope.url}")  # type: ignore[attr-defined]
