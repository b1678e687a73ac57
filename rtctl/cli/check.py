"""`rtctl check CONFIG`: whether a config is right, without compiling its tick or moving anything."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import ConfigArgument, LinkOption, ModeOption, ReferenceOption, SetOption

app = typer.Typer(add_completion=False)


@app.command()
def check(
    config: ConfigArgument,
    reference: ReferenceOption = None,
    mode: ModeOption = None,
    link: LinkOption = None,
    set_: SetOption = None,
    svg: Annotated[
        Path | None, typer.Option("--svg", metavar="FILE.svg", help="Drawing of a described machine, as a picture.")
    ] = None,
) -> None:
    """Check a config and say what it would run. Exit code 2 with every mistake, where it is wrong.

    Of a machine that the config describes it also says what was described, in words and as a drawing, the modes that
    follow, and which parameters a recording by these sensors could tell apart.

    A law or plant of your own, `kind: ./my_law.py:MyLaw`, is compiled by itself, looked through for what allocates, and
    timed on this machine.

    Examples:

      rtctl check ivu.yaml

      rtctl check belt --svg belt.svg

      rtctl check ldu --reference print_steps --set loop.rate='5 kHz'
    """
    settings = common.with_loop(common.load_config(config, set_), mode, link)
    machine = common.machine_of(common.with_reference(settings, reference))
    from rtctl.config.errors import UserError
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
        _report(machine.config, svg)
    elif svg is not None:
        raise UserError(f"--svg: the drawing is of a described machine; {machine.kind} comes with the program")


def _report(config: Any, svg: Path | None) -> None:
    """What the description says."""
    from rtctl.config.errors import UserError
    from rtctl.config.files import write_text
    from rtctl.machine_report import modes, sensitivity, terminal, words
    from rtctl.machine_report.svg import svg as picture

    for group, line in words.sentences(config.machine):
        typer.echo(f"  {group:10}{line}")
    for n, line in enumerate(modes.sentences(config.machine)):
        typer.echo(f"  {'' if n else 'modes':10}{line}")
    for n, line in enumerate(sensitivity.sentences(sensitivity.sensitivity(config))):
        typer.echo(f"  {'' if n else 'tells':10}{line}")
    typer.echo("")
    for line in terminal.drawing(config.machine):
        typer.echo(f"  {line}")
    if svg is not None:
        try:
            write_text(svg, picture(config.machine, config.name))
        except OSError as error:
            raise UserError(f"--svg {svg}: cannot be written: {error.strerror}") from None
        typer.echo(f"\n  drawing in {svg}")


def _own(machine: Any) -> list[tuple[str, str]]:
    """What a check of the user's own files has found. Raises UserError where one may not go into the tick."""
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
    """What a run of this machine would be."""
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
    """What stands at the plant's end of the link."""
    from rtctl.machines import fmu_of

    if fmu_of(config) is not None:
        return f"the FMU {config.plant.fmu.file}"
    driver = config.driver
    return "emulated" if driver.kind == "emulated" else f"{driver.device} by {driver.kind}"


def _reference(machine: Any) -> str:
    table = machine.reference
    if table.n < 2:
        return "holds still until a setpoint comes"
    repeated = ", repeated" if table.period else ""
    return f"{table.n} knots over {table.t[table.n - 1]:g} s, in {machine.unit}{repeated}"
