"""`rtctl get` and `rtctl set`: one setting of a running machine."""

from typing import Annotated

import typer

from rtctl.cli import common, complete
from rtctl.cli.common import JsonOption, NameOption, SignedCommand

app = typer.Typer(add_completion=False)
PathArgument = Annotated[
    str,
    typer.Argument(
        metavar="PATH", help="Dotted path in the config, e.g. law.position.gain.", autocompletion=complete.keys
    ),
]


@app.command("get")
def get(path: PathArgument, json: JsonOption = False, name: NameOption = None) -> None:
    """Print a setting of a running machine, in SI; a part of the config as YAML.

    Examples:

      rtctl get law.position.gain

      rtctl get law --json
    """
    with common.client(name) as client:
        result = client.call("get", path=path)
    if json:
        common.print_json(result)
        return
    value = result["value"]
    if isinstance(value, (dict, list)):
        import yaml

        typer.echo(yaml.safe_dump(value, sort_keys=False), nl=False)
    else:
        typer.echo("null" if value is None else value)


@app.command("set", cls=SignedCommand)
def set_(
    path: PathArgument,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="Written as in the config: 31, '160 ms', model.")],
    json: JsonOption = False,
    name: NameOption = None,
) -> None:
    """Change a setting of a running machine, from the start of a tick on.

    The bundle records the change. A setting that changes the structure of the tick needs a restart.

    Examples:

      rtctl set law.position.gain 25

      rtctl set law.position.tau_d '180 ms'

      rtctl set safety.tension_min -3
    """
    from rtctl.config.yaml_file import parse

    with common.client(name) as client:
        result = client.call("set", path=path, value=parse(value, path).data)
    if json:
        common.print_json(result)
    else:
        typer.echo(f"{result['path']} is {result['value']} from tick {result['tick'] + 1} on")
