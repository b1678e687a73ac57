"""How far a model's free run is from a recording of a described machine, sensor by sensor.

The observer follows until it has forgotten how the machine stood before the recording began; from the state that it
reached there the model runs freely. What moves as it was recorded (kinematic, static) is predicted from the first row.
"""

from pathlib import Path

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.yaml_file import find
from rtctl.diagnose.graph import loop
from rtctl.diagnose.graph.case import read_case
from rtctl.diagnose.graph.joint import check_same
from rtctl.diagnose.graph.kernel import TRACK
from rtctl.diagnose.graph.likelihood import settled
from rtctl.diagnose.graph.model import nominal
from rtctl.diagnose.graph.record import GraphRecord
from rtctl.diagnose.graph.simulate import Simulator
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.measure import NAMES, Channel, Comparison
from rtctl.plants.graph.file import read_machine
from rtctl.plants.graph.term_units import body_of
from rtctl.plants.graph.units import measured_unit


def believing(record: GraphRecord, path: Path | str) -> GraphRecord:
    """The record under the machine and the physics of a config or a bare description, the rest as in its case.

    Raises UserError where the file cannot be read or is of a machine with other elements.
    """
    file = find(str(path))
    told = read_machine(file)
    machine = told.machine.model_dump(mode="json", exclude_unset=True)
    given = {"format": 2, "machine": machine, "physics": list(told.physics), "problem": record.case.problem}
    read = read_case({**given, "delay_samples": record.case.delay_samples}, file.parent)
    new = record.case._replace(machine=read.machine, layout=read.layout, values=read.values, physics=read.physics)
    other = record._replace(case=new._replace(file=file))
    check_same(record, other)
    return other._replace(case=new)


def compare(record: GraphRecord, closed: bool | None = None, skip: int = 0) -> Comparison:
    """Simulate the machine of a record's case freely and compare it; where it was held or followed does not count.

    Closed from the reference with its own law, or open from the recorded commands; closed where the law is known and
    the recording has a reference. Raises UserError where a loop cannot be closed or `skip` leaves less than two rows,
    NoAnswer where the model runs away.
    """
    n, model, sim = len(record.t), nominal(record.case), Simulator(record)
    around = loop.loop_of(record)
    known = around.known and bool(np.isfinite(record.ref).all()) and sim.mode == TRACK
    closed = known if closed is None else closed
    if closed and not known:
        why = "its law is not known" if not around.known else "the recording has no reference"
        raise UserError(f"the loop cannot be closed: {why}; simulate it with --open-loop")
    if not 0 <= skip <= n - 2:
        raise UserError(f"--skip {skip}: the recording has {n} rows, and at least two must be left")
    mode, volts = (CLOSED if closed else OPEN), np.zeros((n, 0))
    if closed:
        out, volts = loop.run(sim, around, model, record.ref, record.w, shaped=True)
    else:
        begin = max(skip, min(settled(sim), n // 4)) if sim.mode == TRACK else skip
        out, skip = sim.released(begin).run(model), begin
    lost = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(lost):
        k = int(lost[0])
        raise NoAnswer(f"the model ran away at tick {k} ({record.t[k] - record.t[0]:.6g} s) in {NAMES[mode]}")
    channels = {name: _channel(sim, name, out, skip) for name in sim.channels}
    for column, (name, drive) in enumerate(record.case.machine.drives.items() if closed else ()):
        channels[name] = Channel(record.u[skip:, column], volts[skip:, column], drive.unit)
    return Comparison(record.t[skip:], channels, mode, skip)


def _channel(sim: Simulator, name: str, out: np.ndarray, skip: int) -> Channel:
    """One sensor in SI. Where a position beside the main one began to count is chance: compared up to a constant."""
    machine = sim.case.machine
    seen, made = sim.record.y[name][skip:], out[skip:, sim.column(name)]
    sensor = machine.sensors.get(name)
    measures = "force" if sensor is None else sensor.measures  # what is no sensor is the force of a drive
    if measures == "position" and name != sim.main:
        made = made + np.mean(seen - made)
    return Channel(seen, made, measured_unit(measures, machine.turns(body_of(machine, name))))
