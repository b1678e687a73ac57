"""A record: the rows of a run while it ran, whether it comes from a bundle or from a fused run.

    record = take(load_bundle("runs/ivu-1"))       a recording of our own daemon
    record = take(fused.run(config, 30.0))         a run on virtual time
    record["capstan"], record.dt, record.config    the same in both cases

Experiments read records and nothing else, so they do not know where the data come from.
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

SWINGING = 0.02  # share of saturated samples above which the excitation alone is not to blame
TURNING = 1e-3  # share of samples that may run against the reference
STEADY = 0.02  # share of the top speed by which the reference may change its speed in a second


@dataclass(frozen=True)
class Record:
    """Rows of a run while it ran, and what they were recorded with."""

    kind: str  # ivu | ldu | axis
    config: Any  # settings that it was recorded with
    dt: float  # s
    columns: Mapping[str, np.ndarray]  # (n,) each, rows while the machine ran
    trip: str  # name of the trip that ended it, "" for none
    trip_time: float  # s of the controller clock
    source: str  # folder, or the name of the machine

    def __getitem__(self, column: str) -> np.ndarray:
        if column not in self.columns:
            near = nearest(column, self.columns)
            raise UserError(f"{self.source}: no column '{column}'" + (f"; is it '{near}'?" if near else ""))
        return np.asarray(self.columns[column], float)

    @property
    def profile(self) -> Profile:
        """What the machine is."""
        return profile_of(self.kind)

    @property
    def signals(self) -> Columns:
        """Names of the position, the command and what was written."""
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
    """The record of a run or a bundle.

    Raises UserError where a bundle holds no config of ours, NoAnswer where the machine never ran.
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
    """The records of one or more runs or bundles. Raises as `take`."""
    several = isinstance(sources, list) or (isinstance(sources, tuple) and not isinstance(sources, Bundle))
    return [take(source) for source in (sources if several else [sources])]


def config_of(bundle: Bundle) -> Any:
    """Settings of the machine that a bundle was recorded with, without the code of its owner that came with it.

    Raises UserError where case.json does not hold them, and where the plant is the user's own.
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
    """Stretches in which the reference moves at a constant speed, each without its first `settle` s.

    Rows that are missing in the recording end a stretch as well.
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
    """Raise NoAnswer where the run tripped, or in the stretches a drive saturates, the loop runs away or the machine
    turns back.
    """
    if record.trip:
        raise NoAnswer(f"{record.source}: the run tripped, {record.trip} at {record.trip_time:.3f} s")
    _check_drive(record, stretches)
    _check_stable(record, stretches)
    _check_sliding(record, stretches)


def _check_drive(record: Record, stretches: list[slice]) -> None:
    limit = record.config.law.limit
    low = -limit.high if limit.low is None else limit.low
    board = 10.0 * (1 - 1 / 2048)  # what a 12-bit bipolar output gives at most
    for name in record.signals.written:
        u = record[name]
        full = (u >= min(limit.high, board) - 5e-3) | (u <= max(low, -board) + 5e-3)
        at = np.concatenate([s.start + np.flatnonzero(full[s]) for s in stretches] or [np.zeros(0, int)])
        if len(at):
            share = len(at) / sum(s.stop - s.start for s in stretches)
            advice = "take a smaller excitation"
            if share > SWINGING:
                advice = "a loop that is not stable swings like that: lower its gain, or else the excitation"
            raise NoAnswer(
                f"{record.source}: the drive saturates, {name} is {u[at[0]]:.3g} V at {record.t[at[0]]:.3f} s, "
                f"{len(at)} samples in all; {advice}"
            )


def _check_stable(record: Record, stretches: list[slice]) -> None:
    """The error may not grow from the first third to the last of a stretch: that is a loop that is not stable."""
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
    """Speed may not change its sign: dry friction that turns damps what is measured (a resonance by a third)."""
    if record.signals.speed not in record.columns:
        return
    speed, ref = record[record.signals.speed], record["ref"]
    for s in stretches:
        against = np.flatnonzero(speed[s] * (ref[s.stop - 1] - ref[s.start]) < 0)
        if len(against) > TURNING * (s.stop - s.start):
            raise NoAnswer(
                f"{record.source}: the machine turns back {len(against)} samples long from "
                f"{record.t[s.start + against[0]]:.3f} s on, and dry friction with it; take less excitation, more "
                "speed, or a law that does not raise a resonance"
            )
