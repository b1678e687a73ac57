"""`rtctl scope`: a running machine on a page in the browser."""

import time
from typing import Annotated

import typer

from rtctl.cli import common

app = typer.Typer(add_completion=False)
PORT = 8642
LOOK = 0.25  # s between two looks for a machine


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

    The machine may start before or after the scope, and may restart. The page is served on 127.0.0.1 only, and can
    change nothing unless --control is given. From another computer: ssh -L 8642:127.0.0.1:8642 HOST.

    Examples:

      rtctl scope

      rtctl scope ldu --port 8700

      rtctl scope ivu --control
    """
    import asyncio

    from rtctl.scope.feed import Feed
    from rtctl.scope.guard import Guard
    from rtctl.scope.server import Scope

    feed = Feed(_name(machine))
    try:
        asyncio.run(Scope(feed, Guard(), control).serve(port, _say, _note))
    finally:
        feed.close()


def _name(machine: str | None) -> str:
    """Name of the machine to show, which need not run yet; without a name the machine that starts first.

    Raises UserError for an endpoint or a file, for several running machines and no name, and for a machine that this
    account may not command.
    """
    from rtctl.config.errors import UserError, nearest

    if machine is not None and "://" in machine:
        raise UserError(f"scope {machine}: give the machine's name; to look from afar, forward the page's port by ssh")
    if machine is not None and machine.endswith((".yaml", ".yml")):
        raise UserError(f"scope {machine}: give the machine's `name`, as its config says it, not the file")
    names = common.running()
    if machine is None and not names:
        _note("no machine runs here; waiting for one, start it with `rtctl run CONFIG`")
        while not (names := common.running()):
            time.sleep(LOOK)
    if machine is None or machine in names:
        with common.client(machine):  # raises UserError where this account may not command it
            return machine or names[0]
    near = nearest(machine, names)
    if names:
        _note(f"of other machines there is {', '.join(names)}" + (f"; did you mean '{near}'?" if near else ""))
    return machine


def _note(line: str) -> None:
    typer.echo(line, err=True)


def _say(scope: object) -> None:
    how = "with control" if scope.control else "read-only"  # type: ignore[attr-defined]
    typer.echo(f"{scope.feed.name}, {how}: {scope.url}")  # type: ignore[attr-defined]
