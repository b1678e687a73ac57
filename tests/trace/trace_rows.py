"""A small trace: every value is a function of the tick, so rows read back can be checked bit-exact."""

import numpy as np

from rtctl.trace.columns import Column

ROW = np.dtype([("tick", "i8"), ("t", "f8"), ("ref", "f8"), ("u1", "f8"), ("state", "i4")], align=True)
COLUMNS = (
    Column("tick", "1", "number of the tick"),
    Column("t", "s", "controller clock at the tick"),
    Column("ref", "rad", "position reference"),
    Column("u1", "V", "voltage to motor 1"),
    Column("state", "1", "of the safety machine"),
)
CASE = {"format": 1, "plant": "ivu", "sample_rate": 500.0, "parameters": {"R_c": 0.0125}}


def make(first: int, count: int) -> np.ndarray:
    """Rows of the ticks from `first` on."""
    rows = np.zeros(count, ROW)
    ticks = np.arange(first, first + count)
    rows["tick"], rows["t"] = ticks, ticks * 0.002
    rows["ref"], rows["u1"], rows["state"] = np.sin(ticks), ticks**0.5, ticks % 7
    return rows


def is_truth(columns, ticks) -> bool:
    """Whether `columns` (a table or a dict of arrays) are exactly the rows of these ticks, bit-exact."""
    truth = make(0, int(max(ticks, default=-1)) + 1)[np.asarray(ticks, dtype=int)]
    return all(np.array_equal(np.asarray(columns[name]), truth[name]) for name in ROW.names)
