"""Record of a described machine: commands, sensors and measured inputs on an even clock, in SI units."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.case.graph_case import GraphCase
from rtctl.case.start import HELD_PROBLEMS
from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.diagnose.model.kinematic import followed
from rtctl.diagnose.model.model import GraphModel, rigid
from rtctl.diagnose.model.owner_law import checked, reference_scale
from rtctl.diagnose.record.columns import unwrap
from rtctl.diagnose.record.format1 import Record
from rtctl.plants.graph.params import drive_gain
from rtctl.trace.clock import even_rows, increasing

MIDDLE = 0.5  # counts, mean distance of the position from the reading of a counter
SPARE = 10  # rows beside one for each unknown that a recording needs for the estimate of its noise
EARLY = 10  # rows of the guess of the first speed


class GraphRecord(NamedTuple):
    """Columns of a recording, row by row."""

    case: GraphCase
    t: np.ndarray  # (n,) s
    dt: float  # s
    ref: np.ndarray  # (n,) SI, nan without a reference
    w: np.ndarray  # (n,) excitation
    u: np.ndarray  # (n, drives) command, in each drive's unit
    y: dict[str, np.ndarray]  # sensor -> (n,) SI; of a counter the middle of the count
    grain: dict[str, float]  # sensor -> resolution, SI; 0 where it is unknown
    forces: np.ndarray | None  # (n, bodies in order) measured inputs, N or Nm
    edges: dict[str, np.ndarray] = {}  # noqa: RUF012  # sensor without direction -> (n,) counts
    positions: dict[str, np.ndarray] = {}  # body -> (n,) measured inputs, rad or m  # noqa: RUF012
    name: str = ""  # of the recording, where there are several of one machine
    scales: tuple[float, float, float] = (1.0, 1.0, 0.0)  # scales of first position and speed; guess of the speed
    source: Record | None = None  # the record of exchange format 1 that was converted

    @property
    def main(self) -> str:
        """Sensor that the observer follows first: the first of a position, else of a speed, else the first.

        A sensor that looks through a tape shows more than the motion of its body, and is taken last of its kind.
        """
        sensors = sorted(self.case.machine.sensors.items(), key=lambda item: item[1].through is not None)
        for wanted in ("position", "speed"):
            for name, sensor in sensors:
                if sensor.measures == wanted and sensor.body is not None and name in self.y:
                    return name
        return next(iter(self.y))


def record_of(columns: dict[str, np.ndarray], case: GraphCase, path: Path) -> GraphRecord:
    """Checked record of these columns; messages name `path`.

    Raises UserError that names file, column, row and the correct value, NoAnswer where the recording supports no
    verdict.
    """
    t = _column(path, columns, "t", "s, clock at the tick")
    unknowns = len(case.fitted)
    if len(t) < unknowns + SPARE:
        raise NoAnswer(
            f"{path} holds {len(t)} rows; {unknowns} unknown numbers and the noise need {unknowns + SPARE} at least"
        )
    rows = len(t)
    t, dt, even = _clock(path, t, case)
    n = len(t)
    blank = np.full(rows, np.nan)
    ref = np.asarray(columns.get("ref", blank), float) / reference_scale(case.controller, case.machine.sensors)
    w = np.nan_to_num(np.asarray(columns.get("w", np.zeros(rows)), float))
    machine = case.machine
    driven = [] if case.problem == "free" else list(machine.drives.values())
    u = np.zeros((n, len(machine.drives)))
    for d, drive in enumerate(driven):
        u[:, d] = even(_column(path, columns, drive.column, f"{drive.unit}, command") * _on(path, columns, drive))
    y: dict[str, np.ndarray] = {}
    grain: dict[str, float] = {}
    edges: dict[str, np.ndarray] = {}
    for name, sensor in machine.sensors.items():
        if sensor.column not in columns and len(machine.sensors) > 1 and y:
            continue
        raw = _column(path, columns, sensor.column, f"sensor {name}")
        counter = sensor.counts_per_unit is not None
        if counter:
            off = np.flatnonzero(raw != np.round(raw))
            if len(off):
                raise UserError(
                    f"{path}: column '{sensor.column}', row {off[0]}: {raw[off[0]]:g} is not a whole number; "
                    "a counter counts"
                )
            raw = unwrap(raw)[0] + MIDDLE
        if not sensor.direction:
            edges[name] = even(raw)
            continue
        y[name] = even(raw) / sensor.scale
        grain[name] = abs(sensor.grain / sensor.scale)
    if u.size and not np.ptp(u, axis=0).any() and case.problem == "driven":
        names = " and ".join(f"'{d.column}'" for d in driven)
        raise NoAnswer(f"{path}: {names} never changes; the machine was not driven, so it supports no verdict")
    if not y:
        raise NoAnswer(f"{path}: no sensor tells a direction; a diagnosis needs a position or speed with direction")
    first = next(iter(y))
    if np.ptp(y[first]) == 0.0:
        raise NoAnswer(f"{path}: column '{machine.sensors[first].column}' never changes; nothing moved")
    forces, positions = _forces(path, columns, case)
    record = GraphRecord(
        case, t, dt, even(ref), even(w), u, y, grain,
        None if forces is None else np.stack([even(f) for f in forces.T], axis=1),
        edges, {body: even(x) for body, x in positions.items()},
    )  # fmt: skip
    if case.problem == "static" and record.main in case.machine.sensors:
        made = _made(case, u, str(case.machine.sensors[record.main].body))
        record = record._replace(y=y | made, grain=grain | dict.fromkeys(made, 0.0))
    _check_problem(path, record)
    record = checked(record._replace(scales=_scales(record)))
    if case.problem != "kinematic":
        return record
    fine = {name: grain[name] or float(np.std(np.diff(y[name], 2))) / 10.0 for name in y}
    return record._replace(case=followed(case, record.main, fine, y[record.main], dt))


def _on(path: Path, columns: dict[str, np.ndarray], drive: Any) -> np.ndarray | float:
    """1 in the rows (n,) in which a drive is on, 0 in the others."""
    if drive.enabled is None:
        return 1.0
    on = _column(path, columns, drive.enabled, "0 or 1, whether the drive is on")
    bad = np.flatnonzero((on != 0.0) & (on != 1.0))
    if len(bad):
        raise UserError(
            f"{path}: column '{drive.enabled}', row {bad[0]}: {on[bad[0]]:g}; it should be 0 (off) or 1 (on)"
        )
    return on


def _made(case: GraphCase, u: np.ndarray, main: str) -> dict[str, np.ndarray]:
    """Measured force (n,) of the drives at the main body, N or Nm, under the name of the first drive."""
    at = levers(GraphModel(case.layout, case.values), main)
    return {next(iter(at)): u @ np.array(list(at.values()))} if at else {}


def levers(model: GraphModel, main: str) -> dict[str, float]:
    """Force of each drive at the body `main` for one unit of its command, N or Nm, joints taken as rigid."""
    machine, values, moved = model.layout.machine, model.base, rigid(model.layout, model.base, main)
    out = {}
    for name, drive in machine.drives.items():
        body = drive.body if drive.body is not None else machine.joints[str(drive.joint)].to
        out[name] = drive_gain(values, name) * moved.get(body, 0.0)
    return out


def _check_problem(path: Path, record: GraphRecord) -> None:
    """Raise NoAnswer where the recording lacks a column of its problem, UserError where an input is the main motion."""
    problem, machine, bodies = record.case.problem, record.case.machine, record.case.layout.bodies
    for name, entry in record.case.inputs.items():
        own = machine.sensors[record.main].body if entry.measures == "position" else None
        if own is not None and bodies[entry.body].coordinate == bodies[own].coordinate:
            raise UserError(
                f"{record.case.file}: inputs.{name}.body: '{entry.body}' moves with the body of sensor {record.main}; "
                "give an input position of another body, behind a spring"
            )
    if problem not in HELD_PROBLEMS:
        return
    shown = {name: machine.sensors[name] for name in record.y if name in machine.sensors}
    if record.main not in shown or shown[record.main].measures not in ("position", "speed"):
        raise NoAnswer(f"{path}: a {problem} problem needs the position or speed of a body, which no column shows")
    if problem == "kinematic" and sum(s.measures == "position" for s in shown.values()) < 2:
        raise NoAnswer(f"{path}: a kinematic problem needs at least two positions; the recording has one")
    if problem == "static" and len(record.y) < 2:
        raise NoAnswer(
            f"{path}: a static problem needs a measured force: the column of a drive, or a sensor of force or current"
        )


def _scales(record: GraphRecord) -> tuple[float, float, float]:
    """Scales of the first position and the first speed of the main sensor, and a guess of the first speed, SI."""
    x = record.y[record.main]
    if record.case.machine.sensors[record.main].measures == "speed":
        return float(np.std(x)) or 1.0, 1.0, 0.0
    few = min(EARLY, len(x))
    guess = float(np.polyfit(record.dt * np.arange(few), x[:few], min(2, few - 1))[-2])
    rate = float(np.sqrt(np.mean(np.gradient(x, record.dt) ** 2)))
    return 0.1 * float(np.ptp(x)) or 1.0, rate or 1.0, guess


def _forces(
    path: Path, columns: dict[str, np.ndarray], case: GraphCase
) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
    """Measured forces (n, bodies), N or Nm, or None, and measured positions (n,) by body, rad or m."""
    names = list(case.machine.bodies)
    forces, positions = None, {}
    for name, entry in case.inputs.items():
        values = _column(path, columns, entry.column, f"input {name}") / entry.per_unit
        if entry.measures == "position":
            positions[entry.body] = values
            continue
        forces = np.zeros((len(values), len(names))) if forces is None else forces
        forces[:, names.index(entry.body)] += values
    return forces, positions


def _clock(path: Path, t: np.ndarray, case: GraphCase):
    """Even times (n,) in s, tick in s, and the function that resamples a column onto the even times."""

    def row(k: int) -> str:
        return f"{path}: column 't', row {k}"

    if case.sample_rate is not None:
        clock = even_rows(t, case.sample_rate, row, "sample_rate in case.json is {:g} Hz", gaps=True)
        return clock.t, 1.0 / case.sample_rate, lambda values: values
    increasing(t, row)
    dt = float(np.median(np.diff(t)))
    even = np.arange(t[0], t[-1] + 0.5 * dt, dt)
    return even, dt, lambda values: np.interp(even, t, values)


def _column(path: Path, columns: dict[str, np.ndarray], name: str, meaning: str) -> np.ndarray:
    if name not in columns:
        hint = nearest(name, columns)
        raise UserError(f"{path} has no column '{name}' ({meaning})" + (f"; is it '{hint}'?" if hint else ""))
    values = np.asarray(columns[name], dtype=float)
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise UserError(f"{path}: column '{name}', row {bad[0]}: {values[bad[0]]:g}; it should be a finite number")
    return values
