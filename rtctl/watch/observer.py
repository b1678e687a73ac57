"""Tracking observer of the diagnosis, carried from one chunk of rows to the next.

The compiled simulation is that of a recording (diagnose/model/kernel.py). Each call begins at the state of the last
call, so that the result does not depend on the lengths of chunks. This module delays commands by whole ticks; the
kernel delays them by the fraction of a tick within the chunk.
"""

import numpy as np

from rtctl.config.errors import UserError
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.prepare import ABSENT, Ready, ready
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.simulate import Simulator

AWAY = 1e3  # times the spread of a sensor in the record: least residual of a model that has diverged


class Observer:
    """The model of a machine under the corrections that keep it on the followed sensors.

    `record` is a recording of this machine in motion. Raises UserError for a problem without a followed sensor.
    """

    def __init__(self, record: GraphRecord, model: GraphModel):
        self.sim = Simulator(record)
        if self.sim.mode != TRACK or self.sim.inputs or len(self.sim.forces) > 1:
            raise UserError(
                f"{record.case.file}: problem {record.case.problem}: a model runs beside a driven machine whose motion "
                "is not given; watch needs problem: driven"
            )
        self.model = model
        self.sensors = [name for name in record.y if name in record.case.machine.sensors]
        self._columns = [self.sim.column(name) for name in self.sensors]
        self.followed = [self.sensors.index(one.sensor) for one in self.sim.followed]
        self._spread = np.array([max(float(np.ptp(record.y[name])), record.grain[name]) for name in self.sensors])
        self._late = int(record.case.delay_samples)
        self._before: np.ndarray | None = None  # (late, drives) last commands
        self._start: Ready | None = None

    def restart(self) -> None:
        """Begin anew at the next row, from standstill."""
        self._start = None

    def step(self, u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n, sensors), SI, and corrections (n, followed), N or Nm at the followed bodies, under commands
        (n, drives) and readings (n, sensors). Residuals are nan from the row on at which the model diverged; the next
        chunk begins anew."""
        seen = np.ascontiguousarray(y[:, self.followed])
        if self._start is None:
            self._begin(u, seen)
        start = self._start
        assert start is not None and self._before is not None
        held = np.concatenate([self._before, u])
        self._before = held[len(u) :].copy()
        n = len(u)
        out, push = np.full((n, start.params.ny), np.nan), np.zeros((n, seen.shape[1]))
        done = self.sim.kernel.module.run(
            start.job, start.p, start.states, start.slots, np.ascontiguousarray(held[:n]), ABSENT,
            seen + start.offsets, ABSENT, ABSENT, out, push,
        )  # fmt: skip
        start.job["lead"] = 0
        out[max(done, 0) :] = np.nan
        self.sim.counted(out, start.offsets)
        e = y - out[:, self._columns]
        wild = ~(np.abs(e[:, self.followed]) < AWAY * self._spread[self.followed]).all(axis=1)
        if wild.any():
            e[int(np.argmax(wild)) :] = np.nan
            self._start = None
        return e, push

    def _begin(self, u: np.ndarray, seen: np.ndarray) -> None:
        """A state at rest where the first row has the followed sensors."""
        first, self.sim.watched = self.sim.watched, seen
        try:
            start = self._start = ready(self.sim, self.model, TRACK)
        finally:
            self.sim.watched = first
        job = start.job
        job["delay"] -= self._late * int(job["substeps"][0])
        self._before = np.repeat(u[:1], self._late, axis=0)
