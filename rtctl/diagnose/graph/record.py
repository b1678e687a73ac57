"""Record of a described machine: commands, sensors and measured inputs on an even clock, in SI units."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.diagnose.columns import unwrap
from rtctl.diagnose.graph.case import GraphCase, read_case
from rtctl.trace.bundle import PARQUET, load_bundle
from rtctl.trace.clock import even_rows, increasing

LEAST_ROWS = 50


class GraphRecord(NamedTuple):
    """Columns of a recording, row by row."""

    case: GraphCase
    t: np.ndarray  # (n,) s
    dt: float  # s
    ref: np.ndarray  # (n,) nan where there is none
    w: np.ndarray  # (n,) excitation
    u: np.ndarray  # (n, drives) command, in each drive's unit
    y: dict[str, np.ndarray]  # sensor -> (n,) SI; a counter's value is the middle of its count
    grain: dict[str, float]  # sensor -> step of its numbers, SI; 0 where nobody knows it
    forces: np.ndarray | None  # (n, bodies in order) measured inputs, N or Nm
    edges: dict[str, np.ndarray] = {}  # noqa: RUF012  # sensor without direction -> (n,) its counts

    @property
    def main(self) -> str:
        """The sensor that the observer follows: the first of a position, else of a speed, else the first."""
        sensors = self.case.machine.sensors
        for wanted in ("position", "speed"):
            for name, sensor in sensors.items():
                if sensor.measures == wanted and sensor.body is not None and name in self.y:
                    return name
        return next(iter(self.y))


def load_record(folder: Path | str) -> GraphRecord:
    """Read and check a bundle of exchange format 2.

    Raises UserError that names file, column and row and says what would be right, NoAnswer where the recording
    supports no verdict.
    """
    bundle = load_bundle(folder)
    case = read_case(bundle.case, bundle.folder)
    return record_of(bundle.columns, case, bundle.folder / PARQUET)


def record_of(columns: dict[str, np.ndarray], case: GraphCase, path: Path) -> GraphRecord:
    """The record of these columns; `path` is told in messages."""
    t = _column(path, columns, "t", "s, clock at the tick")
    if len(t) < LEAST_ROWS:
        raise NoAnswer(f"{path} holds {len(t)} rows; a verdict needs {LEAST_ROWS}")
    rows = len(t)
    t, dt, even = _clock(path, t, case)
    n = len(t)
    blank = np.full(rows, np.nan)
    ref = columns.get("ref", blank)
    w = np.nan_to_num(np.asarray(columns.get("w", np.zeros(rows)), float))
    machine = case.machine
    driven = [] if case.problem == "free" else list(machine.drives.values())
    u = np.zeros((n, len(machine.drives)))
    for d, drive in enumerate(driven):
        u[:, d] = even(_column(path, columns, drive.column, f"{drive.unit}, command"))
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
            raw = unwrap(raw)[0] + 0.5
        if not sensor.direction:
            edges[name] = even(raw)
            continue
        y[name] = even(raw) / sensor.scale
        grain[name] = abs(sensor.grain / sensor.scale)
    if u.size and not np.ptp(u, axis=0).any() and case.problem == "driven":
        names = " and ".join(f"'{d.column}'" for d in driven)
        raise NoAnswer(f"{path}: {names} never changes; the machine was not driven, so it supports no verdict")
    first = next(iter(y))
    if np.ptp(y[first]) == 0.0:
        raise NoAnswer(f"{path}: column '{machine.sensors[first].column}' never changes; nothing moved")
    forces = _forces(path, columns, case)
    return GraphRecord(case, t, dt, even(np.asarray(ref, float)), even(w), u, y, grain, forces, edges)


def _forces(path: Path, columns: dict[str, np.ndarray], case: GraphCase) -> np.ndarray | None:
    if not case.inputs:
        return None
    names = list(case.machine.bodies)
    out = np.zeros((len(columns["t"]), len(names)))
    for name, entry in case.inputs.items():
        out[:, names.index(entry.body)] += _column(path, columns, entry.column, f"input {name}") / entry.per_unit
    return out


def _clock(path: Path, t: np.ndarray, case: GraphCase):
    """Even times, tick, and what lays a column onto them."""

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
