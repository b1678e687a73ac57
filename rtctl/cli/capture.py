"""`rtctl capture`: a piece of the running trace, from now or from a trigger."""

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption, NameOption

app = typer.Typer(add_completion=False)
POLL = 0.05  # s


@app.command()
def capture(
    duration: Annotated[str, typer.Option("--for", metavar="T", help="Total length, e.g. 5s.")],
    pre: Annotated[
        str | None, typer.Option(metavar="T", help="Part of the length before the trigger (or before now).")
    ] = None,
    trigger: Annotated[
        str | None,
        typer.Option(metavar="CONDITION", help="Begin when this turns true; signals in SI, + - * /, and, or, abs."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder of the bundle; the daemon chooses if absent."),
    ] = None,
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="Wait until it is done.")] = True,
    json: JsonOption = False,
    name: NameOption = None,
) -> None:
    """Record a piece of a running machine's trace into a bundle and print where it is.

    Ctrl-C ends the capture and keeps what it has; exit code 3 where the trigger never came.

    Examples:

      rtctl capture --for 5s -o runs/now

      rtctl capture --for 4s --pre 1s --trigger 'abs(capstan_error) > 0.05'
    """
    arguments: dict[str, Any] = {"seconds": common.seconds(duration, "--for"), "pre": common.seconds(pre, "--pre")}
    arguments |= {"trigger": trigger, "out": str(out.absolute()) if out else None}
    with common.client(name) as client:
        state = client.call("capture", **{key: value for key, value in arguments.items() if value is not None})
        if wait:
            state = _wait(client, state)
    if json:
        common.print_json(state)
    else:
        typer.echo(state["bundle"])
    _judge(state)


def _wait(client: Any, state: dict[str, Any]) -> dict[str, Any]:
    """State of the capture when it is done, or ended by Ctrl-C."""
    from rtctl.config.errors import UserError
    from rtctl.daemon.client import listens

    try:
        while not state["done"]:
            time.sleep(POLL)
            state = client.call("capture_status", id=state["id"])
    except KeyboardInterrupt:
        return {**client.call("capture_stop", id=state["id"]), "interrupted": True}
    except UserError as error:
        if listens(client.endpoint):
            raise
        raise UserError(f"the daemon ended; what was captured until then is in {state['bundle']}") from error
    return state


def _judge(state: dict[str, Any]) -> None:
    """Raise UserError where the capture failed, NoAnswer where the trigger never came."""
    from rtctl.config.errors import NoAnswer, UserError

    if state.get("error"):
        raise UserError(state["error"])
    if state["done"] and not state["triggered"]:
        raise NoAnswer(f"the trigger never came; {state['bundle']} holds {state['rows']} rows")
