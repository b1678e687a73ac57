"""`rtctl build CONFIG`: write the tick of a machine and compile it, so that the next run starts at once."""

from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, LinkOption, ModeOption, SetOption

app = typer.Typer(add_completion=False)


@app.command()
def build(
    config: ConfigArgument,
    show: Annotated[bool, typer.Option("--show", help="Print the generated module instead of compiling it.")] = False,
    mode: ModeOption = None,
    link: LinkOption = None,
    set_: SetOption = None,
) -> None:
    """Write and compile the tick of a machine; nothing moves.

    The tick is cached: another structure of the config or another version compiles again, another gain does not.

    Examples:

      rtctl build ivu

      rtctl build ldu.yaml --mode real --link shm

      rtctl build ivu --show | less
    """
    settings = common.with_loop(common.load_config(config, set_), mode, link)
    machine = common.machine_of(settings)
    from rtctl.loop import generate

    link_kind = "shm" if settings.loop.mode == "fused" else settings.link.kind
    path = generate.write(machine, link_kind)
    if show:
        _show(path.read_text())
        return
    entries = _entries(settings)
    cached = all(generate.is_warm(path, entry) for entry in entries)
    if not cached:
        typer.echo("compiling, once for this config structure; half a minute or so ...", err=True)
        _compile(machine, link_kind)
    typer.echo(f"{path} {'cached' if cached else 'compiled'}: {', '.join(entries)}")


def _entries(settings: Any) -> tuple[str, ...]:
    """The compiled functions that a run of this config needs."""
    mode = settings.loop.mode
    if mode == "fused":
        return ("run_fused",)
    from rtctl.machines import emulated

    ours = settings.link.spawns and emulated(settings)
    return (f"run_{mode}", f"plant_{mode}") if ours else (f"run_{mode}",)


def _compile(machine: Any, link: str) -> None:
    """Compile the functions of the loop's and the plant's process, for the array types of a run."""
    import tempfile
    from pathlib import Path

    from rtctl.daemon.plant_process import Plant
    from rtctl.loop import generate, zmq_link
    from rtctl.loop.loop import Loop
    from rtctl.loop.records import layout
    from rtctl.tick.memory import Segment

    made = generate.generate(machine, link)
    with tempfile.TemporaryDirectory(prefix="rtctl-build-") as folder:
        segment = Segment.create(Path(folder) / "segment", layout(made.params, made.tables, made.row, 1000))
        ends = (segment["outputs"], segment["inputs"])
        if link == "zmq":
            zmq_link.load()
            ends = (0, 0)
        Loop(machine, made, segment, *ends).warm()
        if len(_entries(machine.config)) > 1:
            Plant(machine, made, segment["plant_status"], *reversed(ends))


def _show(text: str) -> None:
    """Print a module, in colour on a terminal."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        typer.echo(text, nl=False)
        return
    from rich.syntax import Syntax

    console.print(Syntax(text, "python", theme="ansi_dark", background_color="default"))
