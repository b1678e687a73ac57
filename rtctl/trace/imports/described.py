"""Bundle of exchange format 2 from a table: columns of the drives and sensors, and the nominal model."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from rtctl.config.errors import UserError, nearest
from rtctl.config.units import convert
from rtctl.plants.graph.file import Believed
from rtctl.plants.graph.term_units import turns_at
from rtctl.plants.graph.units import measured_unit
from rtctl.trace.bundle import ROW_GROUP, save_case, write_parquet
from rtctl.trace.imports.counters import unwrapped
from rtctl.trace.imports.make import SUFFIXES, Imported, clock_of, one_length, times_of, whole
from rtctl.trace.imports.plan import ColumnPlan, Plan
from rtctl.trace.imports.table import Table
from rtctl.trace.part import refuse_taken

FORMAT = 2
TOLERANCE = 0.15  # default relative tolerance of the nominal values
OFF_COUNT = 0.1  # counts: tolerance of a converted number to whole counts
PREFIXES, OTHERS = ("m", "u", "k"), ("deg", "turn", "rpm")  # of accepted units of a column
BESIDE = {"ref": "", "w": ""}  # optional columns of every described machine
NOT_OURS = {"plant": "--plant", "parameters": "--parameter"}


class Wanted(NamedTuple):
    """A column that the description names."""

    column: str
    what: str  # "drive amplifier"
    unit: str  # SI unit of the quantity, or the unit of the command
    scale: float  # column units per `unit`
    counts: bool
    help: str


def make_described(table: Table, plan: Plan, believed: Believed, folder: Path | str) -> Imported:
    """Write the bundle of `table` into `folder`, which must not hold one.

    Writes nothing and raises UserError with file, column, row and remedy for an invalid table.
    """
    folder = Path(folder)
    for key, option in NOT_OURS.items():
        if getattr(plan, key):
            raise UserError(f"{option} goes without --machine; the description says what the machine is")
    known = wanted_columns(believed)
    chosen = _chosen(table, plan, known, believed)
    columns, notes = _signals(table, plan, chosen, known)
    machine, more = _seen(table, believed, columns)
    notes += more
    t, rate, more = clock_of(table, plan, columns)
    notes += more
    columns = {"t": t, **{name: values for name, values in columns.items() if name != "t"}}
    case, more = _case(table, plan, believed, machine, rate, len(t))
    notes += more
    refuse_taken(folder)
    units = {name: _shown(known.get(name)) for name in columns} | {"t": "s"}
    fields = [
        pa.field(
            n, pa.float64(), nullable=False, metadata={"unit": units[n], "help": known[n].help if n in known else ""}
        )
        for n in columns
    ]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        batch = pa.record_batch(list(columns.values()), schema=pa.schema(fields))
        write_parquet(folder, (batch.slice(k, ROW_GROUP) for k in range(0, len(t), ROW_GROUP)), batch.schema)
        save_case(folder, case)
    except OSError as error:
        raise UserError(f"{folder}: cannot be written ({error.strerror or error})") from None
    except ValueError as error:
        raise UserError(
            f"the case cannot be written: {error}; numbers of the description and --case are finite"
        ) from None
    return Imported(folder, len(t), rate, units, tuple(notes))


def wanted_columns(believed: Believed) -> dict[str, Wanted]:
    """Columns of the description by name, of drives, sensors and measured inputs."""
    machine = believed.machine
    out: dict[str, Wanted] = {}
    for name, drive in machine.drives.items():
        unit = {"%": "percent"}.get(drive.unit, drive.unit)
        out[drive.column] = Wanted(drive.column, f"drive {name}", unit, 1.0, False, f"command of {name}")
        if drive.enabled is not None:
            out[drive.enabled] = Wanted(drive.enabled, f"switch {name}", "", 1.0, False, f"1 where {name} is on")
    for name, sensor in machine.sensors.items():
        unit = measured_unit(sensor.measures, turns_at(machine, sensor))
        counts = sensor.counts_per_unit is not None
        help_ = f"{sensor.measures} of {sensor.body or sensor.joint or sensor.drive}"
        out[sensor.column] = Wanted(sensor.column, f"sensor {name}", unit, sensor.scale, counts, help_)
    inputs = believed.case.get("inputs")
    for name, entry in inputs.items() if isinstance(inputs, Mapping) else ():
        if isinstance(entry, Mapping) and isinstance(entry.get("column"), str):
            turns = machine.turns(str(entry.get("body")))
            unit = measured_unit("position", turns) if entry.get("measures") == "position" else ("N", "Nm")[turns]
            scale = entry.get("per_unit", 1.0)
            out[entry["column"]] = Wanted(entry["column"], f"input {name}", unit, float(scale), False, f"input {name}")
    return out


def _column_of(name: str, known: Mapping[str, Wanted]) -> str:
    """Column of a name on the left of --map: a column of the description, or the name of its drive or sensor."""
    if name in known:
        return name
    return next((w.column for w in known.values() if w.what.partition(" ")[2] == name), name)


def _chosen(table: Table, plan: Plan, known: dict[str, Wanted], believed: Believed) -> dict[str, ColumnPlan]:
    """File column for each rtctl column: by --map, else by equal name. An empty reference or excitation is left out."""
    named: dict[str, ColumnPlan] = {}
    for name, given in plan.columns.items():
        ours = _column_of(name, known)
        if ours not in known and ours not in (*BESIDE, "t"):
            near = nearest(ours, [*known, *(w.what.partition(" ")[2] for w in known.values())])
            there = ", ".join(f"{w.column} ({w.what})" for w in known.values())
            hint = f"did you mean '{near}'?" if near else f"it has {there}"
            raise UserError(f"--map {name}={given.column}: the machine has no column '{name}'; {hint}")
        before = named.get(ours, ColumnPlan())  # merges --map by the column with --unit by the sensor
        named[ours] = ColumnPlan(
            column=given.column or before.column, unit=given.unit if given.unit is not None else before.unit
        )
    named = {
        ours: given if given.column else given.model_copy(update={"column": ours}) for ours, given in named.items()
    }
    for ours in (*known, *BESIDE, "t"):
        if ours not in named and ours in table.columns and not (ours in BESIDE and table.empty(ours)):
            named[ours] = ColumnPlan(column=ours)
    if "t" not in named and table.clock and plan.rate is None:
        named["t"] = ColumnPlan(column=table.clock)
    problem = plan.case.get("problem", believed.case.get("problem", "driven"))
    if problem in ("driven", "static"):
        _need(table, named, {c: w for c, w in known.items() if w.what.startswith(("drive ", "switch "))}, all)
    _need(table, named, {c: w for c, w in known.items() if w.what.startswith("input ")}, all)
    _need(table, named, {c: w for c, w in known.items() if w.what.startswith("sensor ")}, any)
    return named


def _need(table: Table, named: Mapping[str, ColumnPlan], wanted: Mapping[str, Wanted], enough: Any) -> None:
    absent = [w for column, w in wanted.items() if column not in named]
    if absent and not enough(column in named for column in wanted):
        what = absent[0]
        taken = {given.column for given in named.values()}
        there = [name for name in table.columns if name not in taken][:20]
        raise UserError(
            f"{table.path}: no column is '{what.column}' of {what.what}; name it with --map {what.column}=NAME, one of "
            f"{', '.join(there) or 'none that is left'}"
        )


def _signals(
    table: Table, plan: Plan, chosen: Mapping[str, ColumnPlan], known: Mapping[str, Wanted]
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns by rtctl name in the units of the description, and notes on assumptions."""
    columns: dict[str, np.ndarray] = {}
    notes: list[str] = list(table.notes)
    assumed = []
    for name, given in chosen.items():
        theirs = given.unit if given.unit is not None else table.units.get(given.column)
        if name == "t":
            columns["t"] = times_of(table, given.column, theirs)
            continue
        values = table.numbers(given.column, name)
        want = known.get(name)
        if want is None:
            columns[name] = values
            continue
        if theirs is None or (want.counts and theirs in ("counts", "count")):
            _ask_unit(table, given.column, want)
            if want.counts:
                whole(table, given.column, values)
                values, wrapped = unwrapped(name, values)
                notes += [wrapped] if wrapped else []
            elif unit := _shown(want):
                assumed.append(f"{name} in {unit}")
        else:
            values = _converted(table, given.column, values, theirs, want, notes)
        columns[name] = values
    one_length(table, columns, chosen)
    if assumed:
        notes.append(f"no unit is given: {', '.join(assumed)} assumed")
    return columns, notes


def _shown(want: Wanted | None) -> str:
    """Unit of a column in the description; a minus only reverses the direction."""
    if want is None:
        return ""
    if want.counts:
        return "counts"
    scale = abs(want.scale)
    for unit in (want.unit, *(f"{prefix}{want.unit}" for prefix in PREFIXES), *OTHERS):
        try:
            if abs(convert(1.0, want.unit, unit) / scale - 1.0) < 1e-6:
                return unit
        except ValueError:
            continue
    return f"{want.unit}/{scale:g}"


def _ask_unit(table: Table, column: str, want: Wanted) -> None:
    """Raise UserError for a name such as `pos_mm` with another unit than the description of the column."""
    base, mark, unit = column.rpartition("_")
    if not (base and mark and unit in SUFFIXES):
        return
    try:
        factor = convert(1.0, unit, want.unit) * want.scale
    except ValueError:
        factor = np.nan
    if want.counts or not abs(factor - 1.0) < 1e-9:
        raise UserError(
            f"{table.path}: column '{column}' ({want.what}) has no unit, and its name ends in {unit}, where the "
            f"description has {_shown(want)}; --unit {want.column}={unit} if it is {unit}, "
            f"--unit {want.column}={'counts' if want.counts else want.unit} if it is not"
        )


def _converted(
    table: Table, column: str, values: np.ndarray, theirs: str, want: Wanted, notes: list[str]
) -> np.ndarray:
    """Values (n,) of a column converted from the file's unit to the unit of the description."""
    try:
        factor = convert(1.0, theirs, want.unit) * want.scale
    except ValueError as error:
        raise UserError(
            f"{table.path}: column '{column}' ({want.what}) is in '{theirs}', which is not {want.unit or 'a number'}; "
            f"--unit {want.column}=... says what it is"
        ) from error
    values = values if factor == 1.0 else values * factor
    if not want.counts:
        return values
    off = np.abs(values - np.round(values))
    row = int(np.argmax(off))
    if off[row] > OFF_COUNT:
        raise UserError(
            f"{table.path}: column '{column}', {table.where(row)}: {values[row] / factor:g} {theirs} is "
            f"{values[row]:.6g} counts, which is not whole; of a reading that is not counts, {want.what} has "
            f"per_unit (column units for one {want.unit}) and resolution in place of counts_per_unit"
        )
    notes.append(f"{want.column}: {theirs} made counts, {abs(factor):.6g} for one {theirs}")
    return np.asarray(np.round(values))


def _seen(table: Table, believed: Believed, columns: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], list[str]]:
    """Description without the sensors missing in the file, and a note on each."""
    machine = believed.machine.model_dump(mode="json", exclude_unset=True)
    left = [name for name, s in believed.machine.sensors.items() if s.column not in columns]
    for name in left:
        del machine["sensors"][name]
    return machine, [f"{table.path.name} has no column of sensor {name}: it is left out" for name in left]


def _case(
    table: Table, plan: Plan, believed: Believed, machine: dict[str, Any], rate: float | None, rows: int
) -> tuple[dict[str, Any], list[str]]:
    """case.json, and notes on assumptions."""
    notes = []
    given = dict(plan.case)
    tolerance = dict(believed.tolerance)
    told = given.pop("tolerance", {})
    tolerance |= _flat(told) if isinstance(told, Mapping) else {"default": told}
    if "default" not in tolerance:
        tolerance = {"default": TOLERANCE, **tolerance}
        notes.append(f"no default tolerance is given: {100 * TOLERANCE:g} % assumed")
    carried = dict(believed.case)
    if "delay_samples" not in {**carried, **given}:
        carried["delay_samples"] = 0.0
        if believed.machine.drives:
            notes.append("no delay_samples are given: a command acts at the row that records it")
    return {
        "format": FORMAT,
        "sample_rate": rate,
        "machine": machine,
        "tolerance": tolerance,
        **({"physics": list(believed.physics)} if believed.physics else {}),
        "controller": {"kind": "unknown"},
        "controller_known": False,
        "notes": f"Imported from {table.path.name}.",
        **carried,
        **given,
        "rows": rows,
        "complete": True,
    }, notes


def _flat(given: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """{"bodies": {"motor": 0.1}} as {"bodies.motor": 0.1}."""
    out: dict[str, Any] = {}
    for key, value in given.items():
        out |= _flat(value, f"{above}{key}.") if isinstance(value, Mapping) else {f"{above}{key}": value}
    return out
