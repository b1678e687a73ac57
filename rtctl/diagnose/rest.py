"""A machine that has come to rest tells no more: what follows its last motion would only dilute the error before it."""

import numpy as np

from rtctl.diagnose.record import Record

REST = 3.0  # s, that are kept behind the last motion
STILL = 0.01  # of the travel
CALM = 0.05  # of the command's range: below it nothing is asked of the machine either


def awake(record: Record) -> Record:
    """The recording without a long rest at its end; itself where it has none."""
    x, n = next(iter(record.y.values())), len(record.t)
    far = np.flatnonzero(np.abs(x - x[-1]) > STILL * np.ptp(x))
    kept = round(REST / record.dt)
    end = int(far[-1]) + kept if len(far) else n
    if end + kept >= n or (np.ptp(record.u[end:], axis=0) > CALM * np.ptp(record.u, axis=0)).any():
        return record
    return record._replace(
        t=record.t[:end], ref=record.ref[:end], w=record.w[:end], u=record.u[:end],
        y={name: values[:end] for name, values in record.y.items()},
        columns={name: values[:end] if len(values) == n else values for name, values in record.columns.items()},
    )  # fmt: skip
