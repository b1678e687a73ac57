"""Commands and readings of trace rows in SI, as the diagnosis reads them from a recording, chunk after chunk.

The meaning of columns comes from a record that the diagnosis has read: the offset of each reading reproduces the
readings of this record. Columns that cannot be translated row by row are refused.
"""

from collections.abc import Mapping

import numpy as np

from rtctl.case.graph_case import GraphCase
from rtctl.case.unsaid import measured_amplifier
from rtctl.config.errors import UserError
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.record.columns import through_amplifier, unwrap

SAME = 1e-6  # of the spread: largest difference between a translated column and the column of the record
Columns = Mapping[str, np.ndarray]


class Readings:
    """Translates rows of the machine of `record`, which was read from the columns `columns` (n,) of its running rows.

    Raises UserError where commands or readings of the record do not follow from single rows.
    """

    def __init__(self, record: GraphRecord, columns: Columns, bent: bool):
        self._case: GraphCase = record.case
        self._bent = bent
        sensors = record.case.machine.sensors
        self.sensors = [name for name in record.y if name in sensors]
        self._offsets = dict.fromkeys(self.sensors, 0.0)
        first = self._readings(columns)
        for k, name in enumerate(self.sensors):
            self._offsets[name] = float(np.median(record.y[name] - first[:, k]))
        self.restart()
        u, y, _ = self.take(columns)
        self.restart()
        told = np.stack([record.y[name] for name in self.sensors], axis=1)
        for what, mine, theirs in (("commands", u, record.u), ("readings", y, told)):
            room = SAME * max(float(np.ptp(theirs)), 1e-12)
            if mine.shape != theirs.shape or np.abs(mine - theirs).max() > room:
                raise UserError(
                    f"{record.case.file}: the {what} of this machine cannot be followed row by row; the clock of its "
                    "rows is uneven, or a column is made of several"
                )

    @staticmethod
    def bends(config: object) -> bool:
        """Whether the amplifier of a config's plant bends the command by its measured curve."""
        return isinstance(config, dict) and measured_amplifier(config)

    def restart(self) -> None:
        """Forget the last row: the next row need not follow it."""
        self._last: np.ndarray | None = None
        self._wrapped = np.zeros(len(self.sensors))

    def take(self, columns: Columns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Commands (n, drives), readings (n, sensors) and reference (n,) of rows that follow the last rows; nan
        without a reference."""
        u = np.stack([self._command(columns, d) for d in range(len(self._case.machine.drives))], axis=1)
        y = self._readings(columns)
        for k, name in enumerate(self.sensors):
            y[:, k] = self._whole(k, y[:, k], abs(self._case.machine.sensors[name].scale)) + self._offsets[name]
        ref = np.asarray(columns["ref"], float) if "ref" in columns else np.full(len(u), np.nan)
        return u, y, ref

    def _command(self, columns: Columns, number: int) -> np.ndarray:
        drive = list(self._case.machine.drives.values())[number]
        values = np.asarray(columns[drive.column], float)
        if drive.enabled is not None:
            values = values * np.asarray(columns[drive.enabled], float)
        return through_amplifier(values) if self._bent else values

    def _readings(self, columns: Columns) -> np.ndarray:
        sensors = self._case.machine.sensors
        return np.stack(
            [np.asarray(columns[sensors[n].column], float) / sensors[n].scale for n in self.sensors], axis=1
        )

    def _whole(self, k: int, y: np.ndarray, scale: float) -> np.ndarray:
        """Readings (n,) of a counter without wraps, the rows before taken into account."""
        sensor = self._case.machine.sensors[self.sensors[k]]
        if sensor.counts_per_unit is None or not len(y):
            return y
        if self._last is None:
            self._last = np.full(len(self.sensors), np.nan)
        before = self._last[k]
        counts = np.round(scale * y) if np.isnan(before) else np.round(np.concatenate(([before], scale * y)))
        self._last[k] = counts[-1]
        told = unwrap(counts)[0]
        out = told + self._wrapped[k]
        self._wrapped[k] += told[-1] - counts[-1]
        return (out if np.isnan(before) else out[1:]) / scale
