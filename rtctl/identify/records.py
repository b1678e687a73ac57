"""Record: rows of a run while the machine ran, from a bundle or from a fused run.

    record = take(load_bundle("runs/ivu-1"))       a recording of the daemon
    record = take(fused.run(config, 30.0))         a run on virtual time
    record["capstan"], record.dt, record.config    in both cases

Experiments read only records and do not depend on the source of the data.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.config.errors import NoAnswer, UserError, nearest
from rtctl.loop.fused import Run
from rtctl.machines.profile import Columns, Profile
from rtctl.machines.profiles import profile_of
from rtctl.tick import safety
from rtctl.trace.bundle import Bundle

SWINGING = 0.02  # share of saturated samples above which the excitation is not the only cause
TURNING = 1e-3  # largest share of samples that move against the reference
STEADY = 0.02  # largest change of the reference speed in a second, as a share of the top speed


@dataclass(frozen=True)
class Record:
    """Rows of a run while the machine ran, with the settings of the recording."""

    kind: str  # ivu | ldu | axis
    config: Any  # settings of the recording
    dt: float  # s
    columns: Mapping[str, np.ndarray]  # (n,) each, rows while the machine ran
    trip: str  # name of the trip that ended the run, "" for none
    trip_time: float  # s of the controller clock
    source: str  # folder, or the name of the machine

    def __getitem__(self, column: str) -> np.ndarray:
        if column not in self.columns:
            near = nearest(column, self.columns)
            raise UserError(f"{self.source}: no column '{column}'" + (f"; is it '{near}'?" if near else ""))
        return np.asarray(self.columns[column], float)

    @property
    def profile(self) -> Profile:
        """Profile of the kind of machine."""
        return profile_of(self.kind)

    @property
    def signals(self) -> Columns:
        """Column names of position, command and output."""
        return self.profile.columns

    @property
    def position(self) -> np.ndarray:
        """Measured position (n,), rad or m."""
        return self[self.signals.position]

    @property
    def error(self) -> np.ndarray:
        """Reference minus measured position (n,), rad or m."""
        return self["ref"] - self.position

    @property
    def t(self) -> np.ndarray:
        """Controller clock (n,), s."""
        return self["t"]


def take(source: Run | Bundle | Record) -> Record:
    """Record of a run or a bundle.

    Raises UserError where a bundle holds no rtctl config, NoAnswer where the machine never ran.
    """
    if isinstance(source, Record):
        return source
    if isinstance(source, Run):
        config, name = source.loop.machine.config, source.loop.machine.config.name
        columns: dict[str, np.ndarray] = {n: source.rows[n] for n in source.rows.dtype.names or ()}
    else:
        config, name = config_of(source), str(source.folder)
        columns = dict(source.columns)
    for column in ("t", "tick", "state", "trip", "ref"):
        if column not in columns:
            raise UserError(f"{name}: no column '{column}'; experiments read recordings of `rtctl run`")
    running = np.asarray(columns["state"]) == safety.RUNNING
    causes = np.flatnonzero(np.asarray(columns["trip"]))
    trip = safety.TRIPS[int(columns["trip"][causes[0]])][0] if len(causes) else ""
    when = float(columns["t"][causes[0]]) if len(causes) else float("nan")
    if not running.any():
        raise NoAnswer(f"{name}: the machine never ran" + (f", it tripped: {trip} at {when:.3f} s" if trip else ""))
    kept = {n: np.asarray(column)[running] for n, column in columns.items()}
    return Record(config.kind, config, 1.0 / config.loop.rate, kept, trip, when, name)


def take_all(sources: Any) -> list[Record]:
    """Records of one or more runs or bundles. Raises as `take`."""
    several = isinstance(sources, list) or (isinstance(sources, tuple) and not isinstance(sources, Bundle))
    return [take(source) for source in (sources if several else [sources])]


def config_of(bundle: Bundle) -> Any:
    """Settings of the machine of a bundle, without the user code in the bundle.

    Raises UserError where case.json does not hold the settings, and where the plant is user code.
    """
    from pydantic import ValidationError

    from rtctl import machines
    from rtctl.config.complaints import sentences
    from rtctl.config.fields import Shape, fill
    from rtctl.own.files import refuse_plant
    from rtctl.own.model import without_code

    data = bundle.case.get("config")
    where = bundle.folder / "case.json"
    base = machines.class_of(data)
    if base is None or not isinstance(data, dict):
        raise UserError(f"{where}: no config of a machine under 'config'; experiments read recordings of `rtctl run`")
    refuse_plant(data, f"{where}: config.")
    model, data = without_code(base, data)
    filled = fill(Shape(model, model=model), data)
    try:
        return model.model_validate(filled)
    except ValidationError as error:
        raise UserError(f"{where}: config: {sentences(error, model, filled)}") from error


def steady(record: Record, settle: float = 0.5) -> list[slice]:
    """Slices of rows in which the reference has constant speed, each without its first `settle` s.

    A gap in the recording also ends a slice.
    """
    speed = np.diff(record["ref"]) / record.dt
    top = np.abs(speed).max() if len(speed) else 0.0
    if top == 0.0:
        return []
    even = np.abs(np.diff(speed)) / record.dt < STEADY * top
    even &= np.abs(speed[1:]) > 0.05 * top
    even &= np.diff(record["tick"])[1:] == 1
    edges = np.flatnonzero(np.diff(np.concatenate(([0], even.astype(int), [0]))))
    skip = round(settle / record.dt)
    found = [slice(int(a) + 1 + skip, int(b) + 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [s for s in found if s.stop > s.start]


def check(record: Record, stretches: list[slice]) -> None:
    """Raise NoAnswer where the run tripped, or where in `stretches` a drive saturates, the loop is unstable or the
    machine reverses.
    """
    if record.trip:
        raise NoAnswer(f"{record.source}: the run tripped, {record.trip} at {record.trip_time:.3f} s")
    _check_drive(record, stretches)
    _check_stable(record, stretches)
    _check_sliding(record, stretches)


def _check_drive(record: Record, stretches: list[slice]) -> None:
    limit = record.config.law.limit
    low = -limit.high if limit.low is None else limit.low
    board = 10.0 * (1 - 1 / 2048)  # V, largest output of a 12-bit bipolar board
    for name in record.signals.written:
        u = record[name]
        full = (u >= min(limit.high, board) - 5e-3) | (u <= max(low, -board) + 5e-3)
        at = np.concatenate([s.start + np.flatnonzero(full[s]) for s in stretches] or [np.zeros(0, int)])
        if len(at):
            share = len(at) / sum(s.stop - s.start for s in stretches)
            advice = "take a smaller excitation"
            if share > SWINGING:
                advice = "an unstable loop oscillates like this: lower its gain, then the excitation"
            raise NoAnswer(
                f"{record.source}: the drive saturates, {name} is {u[at[0]]:.3g} V at {record.t[at[0]]:.3f} s, "
                f"{len(at)} samples in all; {advice}"
            )


def _check_stable(record: Record, stretches: list[slice]) -> None:
    """Raise NoAnswer where the error grows from the first third of a stretch to its last: the loop is unstable."""
    for s in stretches:
        e = record.error[s]
        third = len(e) // 3
        if third < 10:
            continue
        first, last = (np.std(part - np.linspace(part[0], part[-1], third)) for part in (e[:third], e[-third:]))
        if last > 5.0 * max(first, 1e-12) and last > 0.05 * np.abs(np.ptp(record["ref"][s])):
            raise NoAnswer(
                f"{record.source}: the loop is not stable, its error grows {last / max(first, 1e-12):.3g} times from "
                f"{record.t[s.start]:.2f} to {record.t[s.stop - 1]:.2f} s"
            )


def _check_sliding(record: Record, stretches: list[slice]) -> None:
    """Raise NoAnswer where the speed changes its sign: reversing dry friction damps a resonance by a third."""
    if record.signals.speed not in record.columns:
        return
    speed, ref = record[record.signals.speed], record["ref"]
    for s in stretches:
        against = np.flatnonzero(speed[s] * (ref[s.stop - 1] - ref[s.start]) < 0)
        if len(against) > TURNING * (s.stop - s.start):
            raise NoAnswer(
                f"{record.source}: the machine reverses for {len(against)} samples from "
                f"{record.t[s.start + against[0]]:.3f} s on, and dry friction with it; take less excitation, more "
                "speed, or a law that does not raise a resonance"
            )
