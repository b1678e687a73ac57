"""`rtctl schema`: JSON Schema of a config, for editors and for people."""

from typing import Annotated

import typer

app = typer.Typer(add_completion=False)


@app.command()
def schema(
    machine: Annotated[str, typer.Argument(metavar="MACHINE", help="ivu, ldu, axis or described.")],
) -> None:
    """Print the JSON Schema of a machine's config: every key with its unit, bounds and meaning.

    Examples:

      rtctl schema ivu > ivu.schema.json

      rtctl schema ldu | jq '.["$defs"].PiVelocitySettings.properties'
    """
    import json

    from rtctl import machines
    from rtctl.config.errors import UserError, nearest
    from rtctl.config.schema import json_schema

    if machine not in machines.EVERY:
        near = nearest(machine, machines.EVERY)
        raise UserError(
            f"no machine '{machine}'; " + (f"did you mean '{near}'?" if near else f"it is {', '.join(machines.EVERY)}")
        )
    typer.echo(json.dumps(json_schema(machines.EVERY[machine]), indent=2))
