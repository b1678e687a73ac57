"""Simulated records of exchange format 1."""

import numpy as np

from rtctl.case.format1 import Case
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.by_symbol import Model
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.model.kernel import OPEN
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record.format1 import Record, commands_of

SENSORS = {
    "axis": ("x",),
    "ivu": ("capstan_counts", "reel1_counts", "reel2_counts"),
    "ldu": ("encoder_counts", "scale_counts"),
}


def at_rest(case: Case, n: int, ref: np.ndarray | None = None, u: np.ndarray | None = None, sensors=()) -> Record:
    """A record of n rows with constant sensors, a reference (n,) and commands u (n, drives)."""
    dt, zero = 1.0 / float(case.sample_rate or 1.0), np.zeros(n)
    volts = np.zeros((n, len(commands_of(case.plant)))) if u is None else u
    y = dict.fromkeys(sensors or SENSORS[case.plant], zero)
    return Record(case.plant, case, np.arange(n) * dt, dt, zero if ref is None else ref, zero, volts, y, {})


def driven(record: Record, model: Model) -> dict[str, np.ndarray]:
    """Readings (n,) by column of a model under the commands of a record, from rest on; counters are not cut."""
    sim, model = _ready(record, model)
    sim = sim.beginning(0.0, 0.0)
    return _columns(sim, sim.run(model, OPEN))


def closed(record: Record, model: Model) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The same under the known law for the reference of a record, and the commands (n, drives)."""
    sim, model = _ready(record, model)
    if sim.layout.nq == 1:
        sim = sim.beginning(0.0, 0.0)
    out, volts = loop.run(sim, loop_of(sim.record), model, record.ref, record.w, shaped=True)
    return _columns(sim, out), volts


def of_closed(record: Record, model: Model) -> Record:
    """Record of the result of `closed`."""
    y, volts = closed(record, model)
    return record._replace(y=y, u=volts)


def _ready(record: Record, model: Model):
    """A simulator, and the model with its terms as they are: a fit may try sizes beyond the bounds of a config."""
    sim = Simulator(graph_record(record, model._replace(terms=())))
    return sim, nominal(sim.case).add(*model.terms)


def _columns(sim: Simulator, out: np.ndarray) -> dict[str, np.ndarray]:
    found = {}
    for name, sensor in sim.case.machine.sensors.items():
        values = sensor.scale * out[:, sim.column(name)]
        if not sensor.direction:
            values = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(values)))])
        found[sensor.column] = values - (0.5 if sensor.counts_per_unit is not None and sensor.direction else 0.0)
    return found
