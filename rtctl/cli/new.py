"""`rtctl new law|plant|term NAME`: the beginning of a file of your own, with a test that passes and a config."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False)


@app.command()
def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="law, plant or term.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="What it is called, e.g. feedforward.")],
    machine: Annotated[
        str, typer.Option("--for", metavar="MACHINE", help="ivu, ldu or axis: whose config comes with it.")
    ] = "ivu",
    into: Annotated[Path, typer.Option("--into", metavar="DIR", help="Folder; made where it is missing.")] = Path(),
) -> None:
    """Write a law, a plant or a term of physics to start from: NAME.py, its test, and NAME.yaml, which uses it.

    Nothing is ever overwritten. docs/tutorial_own_law.md goes on from here.

    Examples:

      rtctl new law feedforward

      rtctl new law cascade --for ldu --into bench

      rtctl new term windage
    """
    from rtctl.own.new import write

    files = write(kind, name, machine, into)
    for path, words in zip(files, ("the " + kind, "its test", "a config that uses it"), strict=True):
        typer.echo(f"{path!s:32}  {words}")
    typer.echo(
        f"next: pytest {files.test}; rtctl check {files.config}; rtctl run {files.config} --mode fused --for 12s"
    )
