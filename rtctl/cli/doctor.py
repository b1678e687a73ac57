"""`rtctl doctor`: which real-time rates this computer can hold, and what to change."""

from pathlib import Path
from typing import Annotated

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption, SetOption

app = typer.Typer(add_completion=False)
RATES = (500.0, 10_000.0)
SLOWEST, FASTEST = 10.0, 50_000.0  # Hz
PRIORITY = 80  # real-time priority of a loop whose config says none


@app.command()
def doctor(
    seconds: Annotated[
        int,
        typer.Option("--seconds", metavar="S", min=1, help="Duration at each rate, by the loop and by cyclictest."),
    ] = 5,
    rate: Annotated[
        list[float] | None,
        typer.Option("--rate", metavar="HZ", help="Rate to measure at; 500 and 10000 if absent. Repeatable."),
    ] = None,
    need: Annotated[
        float | None,
        typer.Option(
            "--need", metavar="HZ", help="Exit code 1 if more than 0.1 % of the ticks at this rate were late."
        ),
    ] = None,
    cpu: Annotated[
        int | None,
        typer.Option(
            "--cpu", metavar="N", help="CPU to measure on; the last isolated, else the last allowed if absent."
        ),
    ] = None,
    measure: Annotated[bool, typer.Option(help="Measure; else only look.")] = True,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE.png", help="Draw the latency histograms here.")
    ] = None,
    board: Annotated[
        str | None,
        typer.Option("--board", metavar="CONFIG", help="Check the wiring of this config's real board instead."),
    ] = None,
    set_: SetOption = None,
    json: JsonOption = False,
) -> None:
    """Check kernel, rights and CPUs, measure how late an empty loop wakes, and say what to change. cyclictest is run as
    well, where it is installed. A bad computer is no error: exit code 0, unless --need asks for a rate.

    Examples:

      rtctl doctor

      rtctl doctor --need 10000 --seconds 60 --json

      rtctl doctor --no-measure

      rtctl doctor --board ivu --set 'driver={kind: comedi, device: /dev/comedi0}'

    With --board it asks you to turn and push things by hand, with all outputs off, and exits with 1 where something is
    wired wrong. Without a terminal, or with --json, it makes only the checks that need no person.
    """
    from rich.console import Console

    from rtctl.config.errors import UserError
    from rtctl.doctor import console, cpus, facts, report, rights, virtual
    from rtctl.doctor.finding import Tree

    if board is not None:
        for option, given in (("--need", need), ("--plot", plot), ("--rate", rate)):
            if given:
                raise UserError(f"{option} measures the machine, --board checks wires; give one of them")
        check_wires(board, set_, json)
        return
    if set_:
        raise UserError("--set changes a config; it needs --board CONFIG")
    rates = check(rate, need, measure, plot)
    tree = Tree()
    where = cpus.loop_cpu(tree) if cpu is None else cpu
    if cpu is not None and cpus.online(tree) and cpu not in cpus.online(tree):
        raise UserError(f"--cpu {cpu}: there is no such CPU; there are {', '.join(map(str, cpus.online(tree)))}")
    allowed = rights.may_fifo(PRIORITY)
    before = virtual.times(tree, where) if measure else virtual.Times(0, 0)
    measured = None
    if measure:
        from rtctl.doctor.measure import measure as run

        lock = rights.memory_lock(tree).verdict == "good"
        beside = common.running()
        with console.progress(json) as say:
            measured = run(rates, seconds, 0 if where is None else where, PRIORITY, allowed, lock, say)
        if beside:
            note = f"not alone: {', '.join(beside)} runs here, and each delays the other; stop it and measure again"
            measured = measured._replace(lacks=[*measured.lacks, note])
    stolen = virtual.steal(
        before, virtual.times(tree, where), "during the measurement" if measure else "since the machine booted"
    )
    findings = facts.facts(tree, PRIORITY, allowed, stolen)
    if plot is not None and measured is not None:
        from rtctl.doctor.plot import plot as draw

        draw(measured, plot, report.title(tree))
    found = report.as_json(tree, findings, measured, need)
    if json:
        common.print_json(found)
    else:
        console.show(Console(), report.title(tree), findings, measured)
    if need is not None and not found["need"]["held"]:
        raise typer.Exit(1)


def check(rates: list[float] | None, need: float | None, measure: bool, plot: Path | None) -> list[float]:
    """Rates to measure at, in Hz, lowest first. Raises UserError where the options contradict each other."""
    from rtctl.config.errors import UserError

    for option, value in (*(("--rate", hz) for hz in rates or ()), *((("--need", need),) if need is not None else ())):
        if not SLOWEST <= value <= FASTEST:
            raise UserError(f"{option} {value:g}: a rate is {SLOWEST:g} to {FASTEST:g} Hz")
    for option, given in (("--need", need), ("--plot", plot), ("--rate", rates)):
        if given and not measure:
            raise UserError(f"{option} needs a measurement; leave out --no-measure")
    if plot is not None and plot.suffix.lower() != ".png":
        raise UserError(f"--plot {plot}: the picture is a PNG; name it {plot.with_suffix('.png')}")
    if plot is not None and not plot.parent.is_dir():
        raise UserError(f"--plot {plot}: there is no folder {plot.parent}")
    return sorted({*(rates or RATES), *((need,) if need is not None else ())})


def check_wires(path: str, overrides: list[str] | None, json: bool) -> None:
    """Run the wiring checks of a config's board; exit code 1 where one is bad."""
    import sys

    from rich.console import Console

    from rtctl.config.errors import UserError
    from rtctl.doctor import board
    from rtctl.doctor.board_console import Terminal, tell
    from rtctl.drivers.board import BoardError

    config = common.load_config(path, overrides)
    if config.name in common.running():
        raise UserError(f"--board: {config.name} runs here and holds the card; `rtctl stop` it first")
    card = board.card_of(config)
    console = Console(stderr=json)
    person = Terminal(console) if sys.stdin.isatty() and sys.stdout.isatty() and not json else None
    try:
        card.open()
        if not json:
            console.print("All outputs are off and stay off.")
        found = board.run(config, card, person, (lambda _: None) if json else (lambda f: tell(console, f)))
    except BoardError as error:
        raise UserError(f"--board: {error}; the outputs are off") from error
    finally:
        card.close()
    bad = [f.name for f in found if f.verdict == "bad"]
    if json:
        common.print_json({"card": card.name, "checks": [f._asdict() for f in found], "bad": bad})
    if bad:
        raise typer.Exit(1)
