"""Closed loop around a described machine: a law, its connections, and the simulation with it."""

import math
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.model import kernel
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.prepare import Ready, path_of, pushing, ready
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record.law import LawParams
from rtctl.idiom import fill_record, record_dtype
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.term_units import turns_at
from rtctl.plants.graph.units import measured_unit


class Loop(NamedTuple):
    """Control law and its connections."""

    law: LawParams
    state: np.ndarray  # (1,) state of the law at the first row
    sensor: str
    scale: float  # the law's reading for one SI unit of the sensor
    give: np.ndarray  # (drives, 2) command of each drive for one unit of either output
    beside: np.ndarray  # (drives,) constant command of each drive beside the law
    unit: str  # of the reference
    limit: float  # largest command of any drive; inf where it is unknown
    known: bool  # whether the law is that of the machine; False: a stand-in

    @property
    def per_unit(self) -> float:
        """Reference for one SI unit of the sensor."""
        return float(self.law.to_unit * self.scale)


def run(
    sim: Simulator, loop: Loop, model: GraphModel, ref: np.ndarray, w: np.ndarray, shaped: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n, sensors), SI, and commands (n, drives) of a model in closed loop, from the first row of `sim` on.

    `ref` (n,) is the reference, before shaping or after it (`shaped`), `w` (n,) the excitation. Readings are nan from
    the tick on at which the model diverged. The feedback sensor begins at its first recorded reading.
    """
    start = ready(sim, model, TRACK)
    n, drives = len(ref), sim.volts.shape[1]
    laws, wired = np.zeros(1, record_dtype(loop.law)), np.zeros(1, kernel.CLOSED)
    fill_record(laws[0], loop.law)
    wired["shaped"] = shaped
    wired["sensor"], wired["scale"] = start.model.layout.sensors[loop.sensor], loop.scale
    wired["give"][0, :drives], wired["beside"][0, :drives] = loop.give, loop.beside
    job = start.job
    path, pace = path_of(sim, job, start.model, float(start.offsets[0]))
    out, volts = np.full((n, start.params.ny), np.nan), np.zeros((n + 1, drives))
    volts[0] = sim.volts[0]
    off = _off(sim, loop, start)
    wanted = np.array(ref, float) + loop.per_unit * off
    done = kernel.closed_loop(sim.code).run(
        job, wired, laws, loop.state.copy(), start.p, start.states, start.slots, wanted, np.array(w, float), volts,
        pushing(sim, start.model), sim.watched[:1] + start.offsets, path, pace, out,
    )  # fmt: skip
    out[max(done, 0) :] = np.nan
    sim.counted(out, start.offsets)
    if loop.sensor not in [one.sensor for one in sim.followed]:
        out[:, start.model.layout.sensors[loop.sensor]] -= off
    return out, volts[1:]


def _off(sim: Simulator, loop: Loop, start: Ready) -> float:
    """Simulated less recorded reading of the feedback sensor at the first row, SI."""
    for number, one in enumerate(sim.followed):
        if one.sensor == loop.sensor:
            return float(start.offsets[number])
    sensor, layout = sim.case.machine.sensors[loop.sensor], start.model.layout
    if sensor.measures != "position" or sensor.body is None or loop.sensor not in sim.record.y:
        return 0.0
    at = layout.coordinate(sensor.body)
    x = start.states["m"]["x"][0, at] + start.job["first_x"][0, at]
    return float(layout.ratio(sensor.body, start.model.base) * x - sim.record.y[loop.sensor][0])


def most_of(machine: Description) -> float:
    """Largest command that every drive of a machine takes, in its unit; inf without a drive."""
    return float(min((d.limit or d.dac_range for d in machine.drives.values()), default=math.inf))


def unit_of(record: GraphRecord, sensor: str) -> str:
    """SI unit of the reading of a sensor."""
    machine = record.case.machine
    return measured_unit(machine.sensors[sensor].measures, turns_at(machine, machine.sensors[sensor]))
