"""`rtctl check CONFIG`: whether a config is right, without compiling its tick or moving anything."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, LinkOption, ModeOption, ReferenceOption, SetOption
from rtctl.config.errors import UserError

app = typer.Typer(add_completion=False)


@app.command()
def check(
    config: ConfigArgument,
    reference: ReferenceOption = None,
    mode: ModeOption = None,
    link: LinkOption = None,
    set_: SetOption = None,
    svg: Annotated[
        Path | None, typer.Option("--svg", metavar="FILE.svg", help="Draw a described machine into this file.")
    ] = None,
) -> None:
    """Check a config and print what it would run. Exit code 2 with a list of all mistakes, where it is wrong.

    For a described machine it also prints the description in words and as a drawing, the modes, and which parameters a
    recording by these sensors can tell apart. A file with the description alone, as for `rtctl import --machine`, is
    checked without the settings of a run.

    A law or plant of your own, `kind: ./my_law.py:MyLaw`, is compiled alone, searched for memory allocations, and timed
    on this computer.

    Examples:

      rtctl check ivu.yaml

      rtctl check belt --svg belt.svg

      rtctl check ldu --reference print_steps --set loop.rate='5 kHz'
    """
    if _description(config):
        for option, value in (("--reference", reference), ("--mode", mode), ("--link", link), ("--set", set_)):
            if value:
                raise UserError(f"{option}: {config} is a description alone; {option} goes with a config")
        _alone(config, svg)
        return
    settings = common.with_loop(common.load_config(config, set_), mode, link)
    machine = common.machine_of(common.with_reference(settings, reference))
    from rtctl.machines import fmu_of
    from rtctl.machines.base import DESCRIBED

    if fmu_of(machine.config) is not None:
        from rtctl.machines.wiring import TERMINALS
        from rtctl.plants.fmu import plan

        plan(machine.config.plant.fmu, *TERMINALS[machine.kind], machine.dt)
    found = _own(machine)
    typer.echo("ok")
    for name, value in [*_summary(machine), *found]:
        typer.echo(f"  {name:10}{value}")
    if machine.kind == DESCRIBED:
        from rtctl.machine_report import sensitivity

        tells = sensitivity.sentences(sensitivity.sensitivity(machine.config))
        _report(machine.config.machine, machine.config.name, tells, svg)
    elif svg is not None:
        raise UserError(f"--svg: the drawing is of a described machine; {machine.kind} comes with the program")


def _description(path: str) -> bool:
    """Whether a file holds only the description of a machine."""
    from rtctl.config.yaml_file import find, load_yaml
    from rtctl.plants.graph.file import is_bare

    return is_bare(load_yaml(find(path)).data)


def _alone(path: str, svg: Path | None) -> None:
    """Check and print a file that holds only a description."""
    from rtctl.own.mechanics import give_machine
    from rtctl.plants.graph.file import read_machine

    give_machine(Path(path))
    believed = read_machine(path)
    typer.echo("ok")
    problem = believed.case.get("problem", "driven")
    typer.echo(f"  {'problem':10}{problem}")
    _report(believed.machine, Path(path).stem, [], svg)
    terms = [f"{entry['term']} at {entry['node']}" for entry in believed.physics]
    if terms:
        typer.echo(f"\n  known     {', '.join(terms)}")


def _report(machine: Any, name: str, tells: list[str], svg: Path | None) -> None:
    """Print a description; `tells` are sentences on the parameters that its sensors tell apart."""
    from rtctl.config.files import write_text
    from rtctl.machine_report import modes, terminal, words
    from rtctl.machine_report.svg import svg as picture

    for group, line in words.sentences(machine):
        typer.echo(f"  {group:10}{line}")
    for head, lines in (("modes", modes.sentences(machine)), ("tells", tells)):
        for n, line in enumerate(lines):
            typer.echo(f"  {'' if n else head:10}{line}")
    typer.echo("")
    for line in terminal.drawing(machine):
        typer.echo(f"  {line}")
    if svg is not None:
        try:
            write_text(svg, picture(machine, name))
        except OSError as error:
            raise UserError(f"--svg {svg}: cannot be written: {error.strerror}") from None
        typer.echo(f"\n  drawing in {svg}")


def _own(machine: Any) -> list[tuple[str, str]]:
    """Rows with the check results of the user's files. Raises UserError where a file must not go into the tick."""
    if not machine.config.own:
        return []
    from rtctl.machines.own_check import verdicts

    rows = []
    for v in verdicts(machine):
        times = f"{v.p99 * 1e6:.3g} us at the 99th percentile and {v.worst * 1e6:.3g} us at worst"
        share = f"{v.p99 / v.period:.2%} and {v.worst / v.period:.2%} of the {v.period * 1e6:g} us it has"
        rows.append(("own", f"{v.spec} compiles in {v.compiled:.1f} s, allocates nothing, takes {times}: {share}"))
        if v.warning:
            rows.append(("", f"warning: {v.warning}"))
    return rows


def _summary(machine: Any) -> list[tuple[str, str]]:
    """Rows of name and text that describe a run of this machine."""
    from rtctl.daemon.server import default_endpoint, runtime_dir

    config = machine.config
    loop, link, commands = config.loop, config.link, config.commands
    law = getattr(config.law.position, "kind", "pd")
    if loop.mode == "fused":
        plant = "emulated, in the loop's own process"
    else:
        endpoint = link.endpoint or f"ipc://{runtime_dir() / f'{config.name}.plant'}"
        where = f"over {link.kind}" if link.kind == "shm" else f"at {endpoint}"
        plant = f"{_stands(config) if link.spawns else 'external'}, {where}"
    terms = [f"{term.term} at {term.node}" for term in config.plant.physics]
    return [
        ("machine", f"{config.name} ({machine.kind})"),
        ("rate", f"{machine.rate:g} Hz, {loop.mode}, writes at the {loop.write.replace('_', ' ')}"),
        ("law", f"{law}, {len(machine.diagram.blocks)} blocks, {len(machine.diagram.columns)} signals"),
        ("reference", _reference(machine)),
        ("plant", plant + (f", with {', '.join(terms)}" if terms else "")),
        ("command", commands.endpoint or default_endpoint(config.name, "command")),
        ("telemetry", commands.telemetry or default_endpoint(config.name, "telemetry")),
    ]


def _stands(config: Any) -> str:
    """Text for the plant's end of the link: emulator, FMU or driver."""
    from rtctl.machines import fmu_of

    if fmu_of(config) is not None:
        return f"the FMU {config.plant.fmu.file}"
    driver = config.driver
    return "emulated" if driver.kind == "emulated" else f"{driver.place} by {driver.kind}"


def _reference(machine: Any) -> str:
    table = machine.reference
    if table.n < 2:
        return "holds still until a setpoint comes"
    repeated = ", repeated" if table.period else ""
    return f"{table.n} knots over {table.t[table.n - 1]:g} s, in {machine.unit}{repeated}"
