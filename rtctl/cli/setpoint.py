"""`rtctl setpoint VALUE`: move a running machine."""

from typing import Annotated

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption, NameOption, SignedCommand

app = typer.Typer(add_completion=False)


@app.command(cls=SignedCommand)
def setpoint(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="[SETPOINT] VALUE", help="The new value, with its unit or in SI; before it, which setpoint."
        ),
    ],
    unit: Annotated[str | None, typer.Option(metavar="UNIT", help="Unit of the value, e.g. mm or rad.")] = None,
    ramp: Annotated[
        str | None, typer.Option(metavar="RATE", help="How fast to go there, e.g. 20mm/s; at once if not given.")
    ] = None,
    json: JsonOption = False,
    name: NameOption = None,
) -> None:
    """Give a running machine a new setpoint, a length or an angle.

    Examples:

      rtctl setpoint 5mm --ramp 20mm/s

      rtctl setpoint -1.2 rad

      rtctl setpoint position 0.3 --unit mm
    """
    from rtctl.config.errors import UserError

    which = words[0] if len(words) > 1 and not common.QUANTITY.fullmatch(words[0]) else None
    text = " ".join(words[1:] if which else words)
    value, written = common.quantity_of(text, "setpoint", "5mm or '1.2 rad'")
    if written and unit and written != unit:
        raise UserError(f"setpoint {text} has a unit of its own; leave out --unit {unit}")
    arguments: dict[str, float | str | None] = {"value": value, "name": which, "unit": written or unit}
    if ramp is not None:
        rate, rate_unit = common.quantity_of(ramp, "--ramp")
        if rate <= 0 or (rate_unit and not rate_unit.endswith("/s")):
            raise UserError(f"--ramp {ramp}: not a speed above zero; write e.g. 20mm/s or 1.5rad/s")
        arguments |= {"ramp": rate, "ramp_unit": rate_unit}
    with common.client(name) as client:
        result = client.call("setpoint", **{key: item for key, item in arguments.items() if item is not None})
    if json:
        common.print_json(result)
        return
    speed = f" at {result['rate']:.6g} {result['unit']}/s" if result["rate"] else ""
    typer.echo(f"to {result['target']:.6g} {result['unit']}{speed}, from tick {result['tick'] + 1} on")
