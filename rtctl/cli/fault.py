"""`rtctl fault`: inject faults into a machine, and test which faults are detected."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common, complete
from rtctl.cli.common import JsonOption, NameOption

app = typer.Typer(
    add_completion=False, no_args_is_help=True, help="Inject faults into a machine, or play all of them for a table."
)


@app.command()
def add(
    fault: Annotated[
        str,
        typer.Argument(
            metavar="FAULT", help="Its name; `rtctl fault list` has them all.", autocompletion=complete.faults
        ),
    ],
    at: Annotated[str | None, typer.Option("--at", metavar="T", help="When, from now on; at once if absent.")] = None,
    lasts: Annotated[str | None, typer.Option("--for", metavar="T", help="How long; until cleared if absent.")] = None,
    channel: Annotated[int, typer.Option("--channel", metavar="N", help="Counter, analog input or output.")] = 0,
    size: Annotated[
        str | None, typer.Option("--size", metavar="X", help="How big, e.g. 0.3 or 20ms; a usual size if absent.")
    ] = None,
    json: JsonOption = False,
    name: NameOption = None,
) -> None:
    """Add a fault to a running machine.

    Examples:

      rtctl fault add encoder.freeze --at 3s --for 200ms

      rtctl fault add link.delay --size 20ms --for 2s

      rtctl fault add plant.kill --for 1s --name ldu
    """
    from rtctl.config.errors import UserError, nearest
    from rtctl.tick.faults import KINDS

    if fault not in KINDS:
        near = nearest(fault, KINDS)
        raise UserError(f"no fault '{fault}'; " + (f"did you mean '{near}'?" if near else "see `rtctl fault list`"))
    wanted: dict[str, Any] = {"fault": fault, "channel": channel, "at": common.seconds(at, "--at") or 0.0}
    if lasts is not None:
        wanted["lasts"] = common.seconds(lasts, "--for")
    if size is not None:
        wanted["size"] = _size(size, KINDS[fault].unit)
    with common.client(name) as client:
        result = client.call("fault", action="add", fault=wanted)
    if json:
        common.print_json(result)
        return
    typer.echo(_line([found for found in result["faults"] if found["fault"] == fault][-1]))


@app.command("list")
def list_(
    catalogue: Annotated[bool, typer.Option("--catalogue", help="All faults, even if a machine runs.")] = False,
    json: JsonOption = False,
    name: NameOption = None,
) -> None:
    """List all faults, or the faults that a running machine has.

    Examples:

      rtctl fault list

      rtctl fault list --name ldu --json
    """
    if catalogue or (name is None and not common.running()):
        _catalogue(json)
        return
    with common.client(name) as client:
        result = client.call("fault", action="list")
    if json:
        common.print_json(result)
        return
    for found in result["faults"]:
        typer.echo(_line(found))
    if not result["faults"]:
        typer.echo("no faults; `rtctl fault list --catalogue` lists all kinds")


@app.command()
def clear(json: JsonOption = False, name: NameOption = None) -> None:
    """Remove all faults of a running machine. Their losses remain: missed counts are not recovered.

    Examples:

      rtctl fault clear
    """
    with common.client(name) as client:
        result = client.call("fault", action="clear")
    if json:
        common.print_json(result)
    else:
        typer.echo(f"no faults from tick {result['tick'] + 1} on")


@app.command()
def table(
    machine: Annotated[str, typer.Option("--machine", metavar="NAME", help="ivu, ldu or all.")] = "all",
    markdown: Annotated[Path | None, typer.Option("--markdown", metavar="FILE", help="Write the page here.")] = None,
    json: JsonOption = False,
) -> None:
    """Play every fault on the shipped machines: what detects it, after how many ticks, and what is lost.

    Takes some minutes. Exit code 1 where a fault was not survived.

    Examples:

      rtctl fault table

      rtctl fault table --machine ldu --markdown /tmp/faults.md
    """
    import structlog

    from rtctl.config.errors import UserError
    from rtctl.config.files import write_text
    from rtctl.faults import page
    from rtctl.faults.cases import STANDS
    from rtctl.faults.table import run

    if machine not in (*STANDS, "all"):
        raise UserError(f"--machine {machine}: it is {', '.join(STANDS)} or all")
    if markdown is not None and not markdown.parent.is_dir():
        raise UserError(f"--markdown {markdown}: there is no folder {markdown.parent}")
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(40))  # no warnings on intended faults
    found = run(list(STANDS) if machine == "all" else [machine], lambda line: typer.echo(line, err=True))
    if markdown is not None:
        write_text(markdown, page.text(found))
    if json:
        rows = {"faults": [o._asdict() for o in found.outcomes], "processes": [s._asdict() for s in found.survived]}
        common.print_json({**rows, "ok": found.ok})
    elif markdown is None:
        typer.echo(page.text(found), nl=False)
    if not found.ok:
        raise typer.Exit(1)


def _size(text: str, unit: str) -> float:
    """Size of a fault in `unit`; a bare number is taken as it is."""
    from rtctl.config.errors import UserError
    from rtctl.config.units import convert

    value, written = common.quantity_of(text, "--size", "0.3 or 20ms")
    if not written:
        return value
    try:
        return convert(value, written, unit)
    except ValueError:
        raise UserError(f"--size {text}: this size is {f'in {unit}' if unit else 'a number without a unit'}") from None


def _catalogue(json: bool) -> None:
    from rtctl.tick.faults import KINDS

    if json:
        common.print_json({"faults": [{"fault": name, **kind._asdict()} for name, kind in KINDS.items()]})
        return
    for name, kind in KINDS.items():
        size = f"  ({kind.size}{f', {kind.unit}' if kind.unit else ''}; {kind.usual:g})" if kind.size else ""
        typer.echo(f"{name:16s} {kind.words}{size}")


def _line(found: dict[str, Any]) -> str:
    until = "for good" if found["end"] is None else f"to {found['end']}"
    channel = f" of channel {found['channel']}" if found.get("channel") else ""
    return f"{found['fault']}{channel}, size {found['size']:g}: tick {found['begin']} {until}" + (
        ", now" if found["active"] else ""
    )
