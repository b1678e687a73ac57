"""Checked recording of exchange format 1 with its case.

Row k holds the readings at the start of tick k and the commands written at its end. A known law, recomputed from the
recorded columns, must give the recorded voltages; otherwise the recorded command is the input.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.case.config_law import ConfigLaw
from rtctl.case.format1 import Case, exchange_of, machine_of, read_case
from rtctl.case.laws import INPUT, KNOWN_LAWS
from rtctl.case.quantities import of_case
from rtctl.case.unsaid import measured_amplifier
from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.diagnose.record import law
from rtctl.diagnose.record.agreement import Agreement, agreement, disagrees
from rtctl.diagnose.record.columns import (
    armed,
    even_clock,
    is_counter,
    laid,
    running,
    through_amplifier,
    unwrap,
    unwrap_turns,
)
from rtctl.diagnose.record.law_params import law_params, law_state
from rtctl.diagnose.record.law_parts import written
from rtctl.diagnose.record.replayed import LawReplay, replayed_law
from rtctl.machines.profile import FREE_UNITS
from rtctl.machines.profiles import profile_of
from rtctl.trace.bundle import PARQUET, Bundle, load_bundle
from rtctl.trace.clock import even_rows, increasing

COUNTED = "x_counts"  # column of the axis of rtctl: its position is the lower edge of a count
LEAST_SECONDS, LEAST_ROWS = 2.0, 500


class Record(NamedTuple):
    plant: str
    case: Case
    t: np.ndarray  # (n,) s, controller clock
    dt: float  # s, nominal
    ref: np.ndarray  # (n,) rad (ivu) or m; nan where it is unknown
    w: np.ndarray  # (n,) V
    u: np.ndarray  # (n, nu) V, or the unit `case.drive.unit`
    y: dict[str, np.ndarray]  # name -> (n,) in the unit of the sensor; counters without wraps
    columns: dict[str, np.ndarray]  # as in the file, `t` at its uneven times
    replay: LawReplay | None = None  # of recordings by rtctl whose law LawParams do not hold
    armed: dict[str, np.ndarray] | None = None  # columns of the rows before the first, in which the law ran already

    @property
    def closed_loop(self) -> bool:
        """Whether the law is known: the reference is the input; otherwise the recorded command is the input."""
        return self.case.controller_known and isinstance(self.case.controller, KNOWN_LAWS)

    @property
    def shows_speed(self) -> bool:
        """Whether the main sensor of an axis measures speed and not position."""
        return "speed" in self.y

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the columns of u."""
        return commands_of(self.plant)


def commands_of(plant: str) -> tuple[str, ...]:
    """Columns of the commands of a kind of machine, in the order of its drives."""
    return tuple(drive.column for drive in machine_of(plant).drives.values())


def load_record(folder: Path | str) -> Record:
    """Checked record of a bundle.

    Raises UserError (exit 2) that names file, column, row and the correct value, NoAnswer (exit 3) where the recording
    supports no verdict.
    """
    bundle = load_bundle(folder)
    return record_of(bundle, read_case(bundle.case, bundle.folder))


def record_of(bundle: Bundle, case: Case) -> Record:
    """Checked record of a bundle in memory, as by `load_record`."""
    columns, earlier = bundle.columns, None
    if isinstance(bundle.case.get("config"), dict) and "state" in columns:
        rows = running(columns["state"])
        if rows.stop - rows.start < len(columns["t"]):
            told = f"{bundle.folder / PARQUET}: rows {rows.start} to {rows.stop - 1} are used, in which the loop ran"
            case = case._replace(warnings=(*case.warnings, told))
        before = armed(columns["state"], rows.start)
        earlier = {name: values[before] for name, values in columns.items()}
        columns = {name: values[rows] for name, values in columns.items()}
        if measured_amplifier(bundle.case["config"]):
            columns |= {name: through_amplifier(columns[name]) for name in commands_of(case.plant) if name in columns}
    return check(columns, case, bundle.folder, bundle, earlier)


def check(
    columns: dict[str, np.ndarray],
    case: Case,
    folder: Path | str = ".",
    whole: Bundle | None = None,
    earlier: dict[str, np.ndarray] | None = None,
) -> Record:
    """Checked record of these columns, by the rules of `load_record`; `whole` is the bundle of the columns, `earlier`
    the rows before them in which the law ran already."""
    path = Path(folder) / PARQUET
    warnings = list(case.warnings)
    if case.estimated and case.reaches.parameter_tolerance is not None:  # null: the owner declares no knowledge
        names = ", ".join(case.estimated)
        warnings.append(
            f"{path.parent / 'case.json'}: parameters does not say {case.estimated[0]}; {names} estimated from the "
            "recording, without a tolerance"
        )
    t = _column(path, columns, "t", "s, clock at the tick")
    u = np.column_stack([_command(path, columns, case, name) for name in commands_of(case.plant)])
    ref = _column(path, columns, "ref", "position reference", missing=not case.controller_known)
    w = _column(path, columns, "w", "V, excitation, 0 where there is none")
    raw = _readings(path, columns, case, warnings)
    t, dt = _clock(path, t, case, warnings)
    if isinstance(case.controller, KNOWN_LAWS) and np.isnan(ref).any():
        case = case._replace(controller_known=False)
    y = {}
    for name, values in raw.items():
        if is_counter(name):
            off = np.flatnonzero(values != np.round(values))
            if len(off):
                raise UserError(
                    f"{path}: column '{name}', row {off[0]}: {values[off[0]]:g} is not a whole number; a counter counts"
                )
            y[name] = unwrap(values)[0]
        else:
            y[name] = unwrap_turns(values) if of_case(case).rotary else values
    if case.sample_rate is None:
        even = even_clock(t, dt)
        y = {name: laid(even, t, values, whole=is_counter(name)) for name, values in y.items()}
        ref, w = laid(even, t, ref), laid(even, t, w)
        u = np.column_stack([laid(even, t, values) for values in u.T])
        t = even
    _supports(path, t, u, y, case, warnings)
    record = Record(case.plant, case, t, dt, ref, w, u, y, columns, armed=earlier)
    agreed = law_agreement(record)
    if (record.closed_loop or case.unsaid) and (agreed is None or not agreed.holds):
        found = replayed_law(whole) if whole is not None else None
        wrong = case.unsaid or disagrees(case.controller.kind, agreed, of_case(case).command)
        words = _replayed(case, found) if found is not None else wrong
        warnings.append(f"{path.parent}: {words}; {INPUT}")
        case, record = case._replace(controller_known=False), record._replace(replay=found)
    return record._replace(case=case._replace(warnings=tuple(warnings)))


def law_agreement(record: Record) -> Agreement | None:
    """Agreement of the recomputed law with the recorded command; None without a law to recompute."""
    again = recompute_law(record)
    if again is None:
        return None
    return agreement(again, record.u)


def recompute_law(record: Record) -> np.ndarray | None:
    """Voltages (n, nu) of the law for the recorded columns; None where the law or its input is unknown."""
    p = law_params(record)
    reading = _reading(record)
    if p.kind == law.NONE or reading is None or np.isnan(record.ref).any():
        return None
    return written(p, law_state(p, record), record.ref, record.w, reading, record.u.shape[1])


def _reading(record: Record) -> np.ndarray | None:
    """Reading (n,) of the main sensor in its unit, as the loop compares it with `ref`; None for a speed sensor."""
    if record.shows_speed:
        return None
    name, values = next(iter(record.y.items()))
    counted = name == "x" and COUNTED in record.columns and not isinstance(record.case.controller, ConfigLaw)
    return record.columns["x"] if counted else values


def _column(path: Path, columns: dict, name: str, meaning: str, missing: bool = False) -> np.ndarray:
    """Column as (n,) floats; `missing`: it may be all nan, or absent."""
    if name not in columns:
        if missing:
            return np.full(len(columns["t"]), np.nan)
        hint = nearest(name, columns)
        raise UserError(f"{path} has no column '{name}' ({meaning})" + (f"; is it '{hint}'?" if hint else ""))
    values = np.asarray(columns[name], dtype=float)
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad) == len(values) and missing and np.isnan(values).all():
        return values
    if len(bad):
        more = f" and {len(bad) - 1} more rows" if len(bad) > 1 else ""
        raise UserError(
            f"{path}: column '{name}', row {bad[0]}{more}: {values[bad[0]]:g}; it should be a finite number"
        )
    return values


def _command(path: Path, columns: dict, case: Case, name: str) -> np.ndarray:
    if name not in columns and case.drive.column in columns:
        name = str(case.drive.column)
    return _column(path, columns, name, f"{case.drive.unit}, written at this tick")


def _readings(path: Path, columns: dict, case: Case, warnings: list[str]) -> dict[str, np.ndarray]:
    """Columns (n,) of the sensors: counters scaled by the case, or the position or speed of a machine without
    counters."""
    if profile_of(case.plant).has(FREE_UNITS):
        return _measured(path, columns, case)
    raw = {}
    for name, scale in exchange_of(case.plant).scales.items():
        said = getattr(case.sensors, scale.key)
        if name not in columns and scale.optional:
            warnings += [f"{path} has no column '{name}', which sensors.{scale.key} describes"] if said else []
            continue
        raw[name] = _column(path, columns, name, "counts")
        if said is None:
            what = (
                "is missing; it turns counts into an angle" if scale.per_turn
                else f"is missing where the recording has {name}; it should say the metres for a count, such as 5e-07"
            )  # fmt: skip
            raise UserError(f"{path.parent / 'case.json'}: sensors.{scale.key} {what}")
    return raw


def _measured(path: Path, columns: dict, case: Case) -> dict[str, np.ndarray]:
    """Column of the position, for a counter at the middle of a count, or of the speed."""
    names = [name for name in (case.sensors.column, "x", "speed") if name is not None and name in columns]
    if not names:
        raise UserError(f"{path} has no column 'x' (m, measured position) and no column 'speed'")
    key = "speed" if names[0] == "speed" else "x"
    values = _column(path, columns, names[0], "measured position")
    if key == "x" and COUNTED in columns and case.sensors.x_resolution_m:
        values = values + 0.5 * case.sensors.x_resolution_m  # a count covers the interval up to the next count
    return {key: values}


def _clock(path: Path, t: np.ndarray, case: Case, warnings: list[str]) -> tuple[np.ndarray, float]:
    """Times (n,) in s and the nominal tick in s, by the rule of `rtctl import`; gaps stay for preflight."""
    if len(t) < 2:
        raise NoAnswer(f"{path} holds {len(t)} rows; a verdict needs {LEAST_ROWS}")

    def row(k: int) -> str:
        return f"{path}: column 't', row {k}"

    if case.sample_rate is None:
        increasing(t, row)
        return t, float(np.median(np.diff(t)))
    clock = even_rows(t, case.sample_rate, row, "sample_rate in case.json is {:g} Hz", gaps=True)
    warnings += [f"{path}: {clock.note}"] if clock.note else []
    return clock.t, 1.0 / case.sample_rate


def _supports(
    path: Path, t: np.ndarray, u: np.ndarray, y: dict[str, np.ndarray], case: Case, warnings: list[str]
) -> None:
    n, seconds = len(t), float(t[-1] - t[0])
    if n < LEAST_ROWS:
        raise NoAnswer(f"{path} holds {n} rows; it supports no verdict, which needs {LEAST_ROWS}")
    if seconds < 0.999 * LEAST_SECONDS:
        raise NoAnswer(f"{path} lasts {seconds:.3g} s; it supports no verdict, which needs {LEAST_SECONDS:g} s")
    if not np.ptp(u, axis=0).any():
        names = " and ".join(f"'{name}'" for name in commands_of(case.plant))
        raise NoAnswer(f"{path}: {names} never changes; the machine was not driven, so it supports no verdict")
    for k, (name, values) in enumerate(y.items()):
        if np.ptp(values) == 0.0:
            if k == 0:
                raise NoAnswer(f"{path}: column '{name}' never changes; nothing moved, so it supports no verdict")
            warnings.append(f"{path}: column '{name}' never changes")


def _replayed(case: Case, found: LawReplay) -> str:
    why = case.unsaid or "the law of the config alone does not give it: it was changed while the recording ran"
    return f"{found.words}: nothing is wrong with it, but {why}" if found.identical else f"{found.words}; {why}"
