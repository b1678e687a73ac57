"""`rtctl import FILE`: a recording of another program as a bundle."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli import common
from rtctl.cli.common import JsonOption

app = typer.Typer(add_completion=False)


@app.command("import")
def import_(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="csv, txt, mat, npz, parquet, json, mcap, mf4, tdms or hdf5.")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="BUNDLE", help="Folder of the bundle to make.")],
    map_: Annotated[
        list[str] | None,
        typer.Option("--map", metavar="OURS=THEIRS,...", help="Which column is which, e.g. u=vir,x=qm. Repeatable."),
    ] = None,
    map_file: Annotated[
        Path | None, typer.Option("--map-file", metavar="YAML", help="These options in a file; see docs/traces.md.")
    ] = None,
    unit: Annotated[
        list[str] | None, typer.Option("--unit", metavar="OURS=UNIT", help="Unit in the file, e.g. x=mm. Repeatable.")
    ] = None,
    rate: Annotated[
        str | None, typer.Option("--rate", metavar="HZ", help="Rows a second, where no column is the time.")
    ] = None,
    machine: Annotated[
        Path | None,
        typer.Option("--machine", metavar="YAML", help="Description of the machine: bodies, joints, drives, sensors."),
    ] = None,
    plant: Annotated[str | None, typer.Option("--plant", metavar="KIND", help="axis, ivu or ldu.")] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option("--parameter", metavar="NAME=VALUE", help="Of the machine, SI or with a unit, e.g. M=95."),
    ] = None,
    case: Annotated[
        list[str] | None,
        typer.Option("--case", metavar="KEY=VALUE", help="Further key of case.json, e.g. drive.newton_per_volt=35.15."),
    ] = None,
    uneven: Annotated[bool, typer.Option("--uneven", help="The rows are at uneven times; keep them so.")] = False,
    names_line: Annotated[
        int | None, typer.Option("--names-line", metavar="N", help="Text: line of the names, 1 the first; 0 for none.")
    ] = None,
    units_line: Annotated[
        int | None, typer.Option("--units-line", metavar="N", help="Text: line of the units; 0 for none.")
    ] = None,
    skip: Annotated[int | None, typer.Option("--skip", metavar="N", help="Text: lines at the top to skip.")] = None,
    separator: Annotated[
        str | None, typer.Option("--separator", metavar="SIGN", help="Text: sign between two cells, or tab or space.")
    ] = None,
    decimal: Annotated[str | None, typer.Option("--decimal", metavar="SIGN", help="Text: decimal sign, . or ,")] = None,
    encoding: Annotated[
        str | None, typer.Option("--encoding", metavar="NAME", help="Text: character encoding, e.g. utf-16 or cp1252.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Make a bundle of another program's recording, in SI units, so that plot, compare and diagnose work on it.

    Units are those of --unit, else those that the file names, else SI. Without --map, columns that already have the
    names of rtctl are taken. With --machine, OURS are the columns of the description's drives and sensors, or their
    names; the description, its tolerance and known physics go into the bundle. In a text file the names, units,
    separator and decimal sign are detected.

    Examples:

      rtctl import emps.mat --out emps --plant axis --map u=vir,x=qm --parameter M=95

      rtctl import log.csv --out bench --plant axis --map u=volts --unit x=mm --rate 1kHz

      rtctl import log.parquet --out bench --map-file log.yaml

      rtctl import log.csv --machine belt.yaml --map u=volts,encoder_counts=pos --out bench
    """
    from rtctl.trace.imports import read
    from rtctl.trace.imports.make import make_bundle
    from rtctl.trace.imports.plan import Plan, load_plan, with_options

    plan = load_plan(map_file) if map_file is not None else Plan()
    text = {
        "names_line": names_line, "units_line": units_line, "skip": skip, "separator": separator, "decimal": decimal,
        "encoding": encoding,
    }  # fmt: skip
    plan = with_options(plan, plant, map_ or [], unit or [], rate, parameter or [], case or [], uneven, text)
    if machine is not None:
        from rtctl.own.mechanics import give_machine
        from rtctl.plants.graph.file import read_machine
        from rtctl.trace.imports.described import make_described

        give_machine(machine)
        believed = read_machine(machine)
        made = make_described(read(file, plan.text), plan, believed, out)
    else:
        made = make_bundle(read(file, plan.text), plan, out)
    lacks = _diagnosable(out)
    if json:
        common.print_json({**made._asdict(), "folder": str(made.folder), "notes": list(made.notes), "lacks": lacks})
        return
    at = f"at {made.rate:g} Hz" if made.rate else "at uneven times"
    typer.echo(f"{made.rows} rows {at}: {', '.join(f'{n} [{u}]' if u else n for n, u in made.columns.items())}")
    for note in made.notes:
        typer.echo(f"note: {note}")
    if lacks:
        typer.echo(f"note: it can be drawn and compared; diagnose would say: {lacks}")
    typer.echo(f"bundle {made.folder}")


def _diagnosable(folder: Path) -> Any:
    """Reason for which `rtctl diagnose` would refuse the bundle; None where it would accept it."""
    from rtctl.config.errors import NoAnswer, UserError
    from rtctl.diagnose.answer.load import load

    try:
        load(folder)
    except (UserError, NoAnswer) as error:
        return str(error)
    return None
