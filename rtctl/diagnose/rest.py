"""A machine at rest tells no more: rows that follow its last motion only dilute the error before it, and where dry
friction holds it between two motions the error stays what it happened to be when it stopped, one number and not as many
as there are rows."""

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rtctl.diagnose.record import Record

REST = 3.0  # s, that are kept behind the last motion
STILL = 0.01  # of the travel
HELD = 3.5  # steps of the sensor: a noisy one shows as much of a machine that stands
CALM = 0.05  # of the command's range: below it nothing is asked of the machine either


def awake(record: Record) -> Record:
    """The recording without a long rest at its end; itself where it has none."""
    x, n = next(iter(record.y.values())), len(record.t)
    far = np.flatnonzero(np.abs(x - x[-1]) > STILL * np.ptp(x))
    kept = round(REST / record.dt)
    end = int(far[-1]) + kept if len(far) else n
    if end + kept >= n or (np.ptp(record.u[end:], axis=0) > CALM * np.ptp(record.u, axis=0)).any():
        return record
    return upto(record, end)


def upto(record: Record, end: int) -> Record:
    """The first `end` rows of a recording."""
    n = len(record.t)
    return record._replace(
        t=record.t[:end], ref=record.ref[:end], w=record.w[:end], u=record.u[:end],
        y={name: values[:end] for name, values in record.y.items()},
        columns={name: values[:end] if len(values) == n else values for name, values in record.columns.items()},
    )  # fmt: skip


def shares(x: np.ndarray, grain: float, memory: int) -> np.ndarray:
    """What each row (n,) of the main sensor's readings x counts for: 1 in motion, and all of a stop for as much as
    `memory` rows in motion. `grain` is the step of the readings."""
    still = maximum_filter1d(x, memory) - minimum_filter1d(x, memory) < HELD * grain
    out = np.ones(len(x))
    ends = np.flatnonzero(np.diff(np.concatenate(([0], still.astype(int), [0]))))
    for begin, end in ends.reshape(-1, 2):
        out[begin:end] = min(1.0, memory / (end - begin))
    return out
