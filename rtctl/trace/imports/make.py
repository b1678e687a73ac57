"""Bundle from a table and a plan: SI units, even clock, finite numbers, and a case with the nominal model."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from rtctl import machines
from rtctl.config.errors import UserError, nearest
from rtctl.config.units import convert
from rtctl.machines.base import Column
from rtctl.machines.profile import FREE_UNITS
from rtctl.machines.profiles import profile_of
from rtctl.trace.bundle import ROW_GROUP, save_case, write_parquet
from rtctl.trace.clock import even_rows, increasing
from rtctl.trace.imports.case import case_of, checked
from rtctl.trace.imports.counters import per_turn, unwrapped
from rtctl.trace.imports.plan import ColumnPlan, Plan
from rtctl.trace.imports.table import Table
from rtctl.trace.imports.times import is_date
from rtctl.trace.part import refuse_taken

OTHER_UNITS = {  # of an axis: alternatives to the model's m, m/s and V, one choice for a recording
    "m": ("m", "rad", "V"),
    "m/s": ("m/s", "rad/s", "V/s"),
    "V": ("V", "A", "N", "Nm"),
}
COUNTS = "_counts"
SLOWEST, FASTEST = 100.0, 1e-7  # s from row to row: beyond these limits a time needs a unit
LATEST = 1e11  # s since 1970 (year 5138): a later time counts milliseconds or less
SUFFIXES = frozenset(  # unit suffixes of a name, `time_ms`; not `in` or `min`: u_in is an input, x_min a minimum
    ("ns", "us", "\u00b5s", "\u03bcs", "ms", "nm", "um", "\u00b5m", "\u03bcm", "mm", "cm", "km", "deg", "rad", "mrad",
     "rev", "rpm", "Hz", "uV", "mV", "V", "kV", "uA", "mA", "A", "mN", "N", "kN", "mNm", "Nm")
)  # fmt: skip


class Imported(NamedTuple):
    folder: Path
    rows: int
    rate: float | None  # Hz; None: uneven
    columns: dict[str, str]  # name -> unit
    notes: tuple[str, ...]  # sentences for the user


def make_bundle(table: Table, plan: Plan, folder: Path | str) -> Imported:
    """Write the bundle of `table` into `folder`, which must not hold one.

    Writes nothing and raises UserError with file, column, row and remedy for an invalid table.
    """
    folder = Path(folder)
    if plan.plant is None:
        raise UserError("--plant: say what kind of machine it is: axis, ivu or ldu")
    known = known_columns(plan.plant)
    columns, units, notes = _signals(table, _wanted(table, plan, known), plan, known)
    t, rate, more = clock_of(table, plan, columns)
    notes += more
    columns = {"t": t, **{name: values for name, values in columns.items() if name != "t"}}
    units = {"t": "s", **units}
    if "w" not in columns:
        columns["w"], units["w"] = np.zeros(len(t)), "V"
        notes.append("no column is w, the excitation: it is taken as 0")
    case = case_of(table, plan, units, rate, len(t))
    notes += checked(case, folder)
    refuse_taken(folder)
    made = [known.get(name, Column(name, "", ""))._replace(unit=units[name]) for name in columns]
    fields = [pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit, "help": c.help}) for c in made]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        batch = pa.record_batch(list(columns.values()), schema=pa.schema(fields))
        write_parquet(folder, (batch.slice(k, ROW_GROUP) for k in range(0, len(t), ROW_GROUP)), batch.schema)
        save_case(folder, case)
    except OSError as error:
        raise UserError(f"{folder}: cannot be written ({error.strerror or error})") from None
    return Imported(folder, len(t), rate, units, tuple(notes))


def known_columns(plant: str) -> dict[str, Column]:
    """Columns that a recording of this machine may hold, by name."""
    return {column.name: column for column in (*machines.MODULES[plant].COLUMNS, *profile_of(plant).truth)}


def _wanted(table: Table, plan: Plan, known: dict[str, Column]) -> dict[str, ColumnPlan]:
    """File column for each rtctl column: by the plan, or by equal name where the plan has no columns."""
    named = {name: given for name, given in plan.columns.items() if given.column}
    if not set(named) - {"t"}:
        named = {**{name: ColumnPlan(column=name) for name in table.columns if name in known}, **named}
    if "t" not in named and "t" in table.columns:
        named["t"] = ColumnPlan(column="t")
    elif "t" not in named and table.clock and plan.rate is None:
        named["t"] = ColumnPlan(column=table.clock)
    if not set(named) - {"t"}:
        there = ", ".join(list(table.columns)[:20])
        if not there:
            left = "; ".join(f"{name} is {why}" for name, why in list(table.left.items())[:10])
            raise UserError(f"{table.path} has no column of numbers; {left or 'it is empty'}")
        raise UserError(f"{table.path} has {there}; say which is which, e.g. --map 'u=vir,x=qm'")
    for name, given in plan.columns.items():
        if not given.column:
            named[name] = ColumnPlan(column=named[name].column if name in named else name, unit=given.unit)
    for name in named:
        near = nearest(name, known)
        if name not in known and near and near not in named:
            raise UserError(f"--map {name}={named[name].column}: a machine has no '{name}'; did you mean '{near}'?")
    return named


def _signals(
    table: Table, wanted: dict[str, ColumnPlan], plan: Plan, known: dict[str, Column]
) -> tuple[dict[str, np.ndarray], dict[str, str], list[str]]:
    """Columns in SI by rtctl name, their units, and notes on assumptions."""
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    assumed = []
    notes: list[str] = list(table.notes)
    for name, given in wanted.items():
        theirs = given.unit if given.unit is not None else table.units.get(given.column)
        if name == "t":
            if theirs is None and not is_date(table.has(given.column, "t")):
                assumed.append("t in s")
            columns[name], units[name] = times_of(table, given.column, theirs), "s"
            continue
        values = table.numbers(given.column, name)
        ours = known[name].unit if name in known else theirs or ""
        choices = OTHER_UNITS.get(ours, (ours,)) if profile_of(plan.plant or "").has(FREE_UNITS) else (ours,)
        if theirs is None:
            ask_suffix(table, name, given.column, ours, choices)
            assumed += [f"{name} in {ours}"] if ours not in ("", "counts", "ticks") else []
        elif name in known:
            factor, ours = unit_factor(table, name, given.column, theirs, choices)
            values = values if factor == 1.0 else values * factor
        if name.endswith(COUNTS):
            whole(table, given.column, values)
            values, wrapped = unwrapped(name, values, per_turn(plan.case))
            notes += [wrapped] if wrapped else []
        columns[name], units[name] = values, ours
    one_length(table, columns, wanted)
    if assumed:
        notes.append(f"no unit is given: {', '.join(assumed)} assumed")
    return columns, units, notes


def one_length(table: Table, columns: dict[str, np.ndarray], origin: Mapping[str, ColumnPlan]) -> None:
    """Raise UserError where columns differ in length or hold no rows; `origin` maps rtctl names to file columns."""
    lengths = {name: len(values) for name, values in columns.items()}
    first = next(iter(columns))
    for name, length in lengths.items():
        if length != lengths[first]:
            raise UserError(
                f"{table.path}: column '{origin[name].column}' has {length} rows where '{origin[first].column}' has "
                f"{lengths[first]}; map columns of one recording"
            )
    if not lengths[first]:
        raise UserError(f"{table.path} holds no rows")


def times_of(table: Table, column: str, theirs: str | None) -> np.ndarray:
    """Times (n,) in s."""
    if is_date(table.has(column, "t")):
        return table.times(column, 1.0)
    if theirs is not None:
        return table.times(column, unit_factor(table, "t", column, theirs, ("s",))[0])
    ask_suffix(table, "t", column, "s", ("s",))
    t = table.times(column, 1.0)
    step = float(np.median(np.abs(np.diff(t)))) if len(t) > 1 else 0.0
    begin = abs(float(table.columns[column][0])) if len(t) else 0.0  # integers are counted from the first row
    if step > SLOWEST or 0.0 < step < FASTEST or begin > LATEST:
        what = f"it begins at {begin:.6g} s" if begin > LATEST else f"its rows would be {step:.6g} s apart"
        raise UserError(
            f"{table.path}: column '{column}' (t) has no unit, and {what}; --unit t=ns, us, ms or d (days) says what "
            "it counts, --unit t=s that it is so"
        )
    return t


def ask_suffix(table: Table, name: str, column: str, ours: str, choices: Sequence[str]) -> None:
    """Raise UserError for a column without unit whose name, such as `pos_mm`, ends in another unit of its dimension."""
    base, mark, unit = column.rpartition("_")
    if not (base and mark and unit in SUFFIXES):
        return
    for choice in choices:
        try:
            if convert(1.0, unit, choice) == 1.0 and choice == ours:
                return
        except ValueError:
            continue
        raise UserError(
            f"{table.path}: column '{column}' ({name}) has no unit, and its name ends in {unit}; "
            f"--unit {name}={unit} if it is, --unit {name}={ours} if it is not"
        )


def unit_factor(table: Table, name: str, column: str, theirs: str, choices: Sequence[str]) -> tuple[float, str]:
    """Factor from the file's unit to the rtctl unit, and the rtctl unit: the first of `choices` that fits."""
    first: ValueError | None = None
    if theirs in choices:
        return 1.0, theirs
    for unit in choices:
        try:
            return convert(1.0, theirs, unit), unit
        except ValueError as error:
            first = first or error
    wanted = choices[0] or "a number without unit"
    given = f"in '{theirs}'" if theirs else "a number without unit"
    raise UserError(
        f"{table.path}: column '{column}' ({name}) is {given}, which is not {wanted}; --unit {name}=... says what it is"
    ) from first


def whole(table: Table, column: str, values: np.ndarray) -> None:
    off = np.flatnonzero(values != np.round(values))
    if len(off):
        raise UserError(
            f"{table.path}: column '{column}', {table.where(int(off[0]))}: {values[off[0]]:g} is not a whole number; "
            "a counter counts"
        )


def clock_of(table: Table, plan: Plan, columns: dict[str, np.ndarray]) -> tuple[np.ndarray, float | None, list[str]]:
    """Times (n,) in s, rate in Hz (None for permitted uneven times), and notes."""
    n = len(next(iter(columns.values())))
    if "t" not in columns:
        if plan.rate is None:
            raise UserError(
                f"{table.path}: no time column; name it with --map t=NAME, or give the rate, e.g. --rate 1000"
            )
        return np.arange(n) / plan.rate, plan.rate, []
    t = columns["t"]
    if n < 2:
        raise UserError(f"{table.path} holds one row; a recording has two or more")

    def row(k: int) -> str:
        return f"{table.path}: time, {table.where(k)}"

    if plan.uneven:
        increasing(t, row)
        return t, None, []
    clock = even_rows(t, plan.rate, row)
    return clock.t, clock.rate, [clock.note] if clock.note else []
