"""`rtctl new law|plant|term|machine|config NAME`: a first version of a file of your own that runs."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False)


@app.command()
def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="law, plant, term, machine or config.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="What it is called, e.g. feedforward.")],
    machine: Annotated[
        str, typer.Option("--for", metavar="MACHINE", help="ivu, ldu or axis: whose config comes with it.")
    ] = "ivu",
    like: Annotated[
        str | None,
        typer.Option(
            "--like",
            metavar="MACHINE",
            help="Machine to start from: belt, arm, screw, torsion, pendulum, hoist, spindle, gantry, two-motor, axis, "
            "furuta, cart-pole, ivu-old; belt if not given. Of a config: ivu, ldu, axis, ivu_coarse, ivu_precise, "
            "ldu_printer; ivu if not given.",
        ),
    ] = None,
    into: Annotated[Path, typer.Option("--into", metavar="DIR", help="Folder; made if it is missing.")] = Path(),
) -> None:
    """Write a law, a plant or a term of physics to start from: NAME.py, its test, and NAME.yaml, which uses it.

    For a machine it writes NAME.yaml, which runs unchanged: bodies, joints, drives and sensors with their units, a law
    and a reference; see docs/bring_your_own_machine.md. For a config it writes NAME.yaml with every key of the unit in
    --like.

    Nothing is ever overwritten. docs/tutorial_own_law.md shows the next steps.

    Examples:

      rtctl new law feedforward

      rtctl new law cascade --for ldu --into bench

      rtctl new term windage

      rtctl new machine winder.yaml --like spindle

      rtctl new config bench.yaml --like ivu
    """
    if kind in ("machine", "config"):
        from rtctl.own.new_like import write_like

        like = like or {"machine": "belt", "config": "ivu"}[kind]
        path = write_like(kind, name, like, into)
        about = "bodies, joints, drives, sensors, law, reference" if kind == "machine" else "loop, law, reference"
        tune = f"rtctl tune {path} -o tuned.yaml; " if kind == "machine" else ""
        typer.echo(f"{path!s:32}  a {kind} like {like}: {about}")
        typer.echo(f"next: rtctl check {path}; {tune}rtctl run {path} --mode fused --for 4s")
        return
    from rtctl.own.new import write

    files = write(kind, name, machine, into)
    for path, words in zip(files, ("the " + kind, "its test", "a config that uses it"), strict=True):
        typer.echo(f"{path!s:32}  {words}")
    typer.echo(
        f"next: pytest {files.test}; rtctl check {files.config}; rtctl run {files.config} --mode fused --for 12s"
    )
