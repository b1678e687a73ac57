"""The rows that tell something. A machine at rest tells no more: rows that follow its last motion only dilute the error
before it, and where dry friction holds it between two motions the error stays what it happened to be when it stopped,
one number and not as many as there are rows. Nor do hours tell more than minutes, which take all the memory there is.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rtctl.diagnose.record import Record

REST = 3.0  # s, that are kept behind the last motion
STILL = 0.01  # of the travel
HELD = 3.5  # steps of the sensor: a noisy one shows as much of a machine that stands
CALM = 0.05  # of the command's range: below it nothing is asked of the machine either
MEAN = 0.4e-3  # s, over which errors are averaged: no machine here does more in that time
LONGEST = {"ivu": 100_000, "ldu": 50_000, "axis": 200_000}  # errors of a sensor; the search holds 5 to 25 kB for each


def telling(record: Record) -> tuple[Record, list[str]]:
    """The rows of the recording that tell something, and what is left out, in words."""
    waking = awake(record)
    kept = bounded(waking)
    seconds = len(record.t) * record.dt
    if len(kept.t) < len(waking.t):
        looked_at = f"{kept.t[0]:.0f} to {kept.t[-1]:.0f} s are looked at"
        return kept, [f"Of {seconds:.0f} s, {looked_at}; rtctl simulate tells how the model predicts all of them."]
    rests = seconds - len(kept.t) * kept.dt
    return kept, [f"The last {rests:.0f} s, in which it rests, are left out."] if kept is not record else []


def awake(record: Record) -> Record:
    """The recording without a long rest at its end; itself where it has none."""
    x, n = next(iter(record.y.values())), len(record.t)
    far = np.flatnonzero(np.abs(x - x[-1]) > STILL * np.ptp(x))
    kept = round(REST / record.dt)
    end = int(far[-1]) + kept if len(far) else n
    if end + kept >= n or (np.ptp(record.u[end:], axis=0) > CALM * np.ptp(record.u, axis=0)).any():
        return record
    return upto(record, end)


def bounded(record: Record) -> Record:
    """As much of the recording, from its first motion on, as the search can hold; itself where that is all."""
    x, longest = next(iter(record.y.values())), LONGEST[record.plant] * averaged(record.dt)
    if len(x) <= longest:
        return record
    first = int(np.argmax(np.abs(x - x[0]) > STILL * np.ptp(x)))
    begin = max(0, first - round(REST / record.dt))
    return part(record, begin, begin + longest)


def averaged(dt: float) -> int:
    """Ticks of dt s that are averaged into one error."""
    return max(1, round(MEAN / dt))


def upto(record: Record, end: int) -> Record:
    """The first `end` rows of a recording."""
    return part(record, 0, end)


def part(record: Record, begin: int, end: int) -> Record:
    """The rows of a recording from `begin` up to `end`."""
    n, kept = len(record.t), slice(begin, end)
    return record._replace(
        t=record.t[kept], ref=record.ref[kept], w=record.w[kept], u=record.u[kept],
        y={name: values[kept] for name, values in record.y.items()},
        columns={name: values[kept] if len(values) == n else values for name, values in record.columns.items()},
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
