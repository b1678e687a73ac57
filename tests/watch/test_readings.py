"""Rows in SI units as in the diagnosis: counters are unwrapped across chunks."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.diagnose.answer.load import of_bundle
from rtctl.trace.bundle import Bundle
from rtctl.watch.readings import Readings


@pytest.fixture(scope="module")
def first(rehearsed):
    rows = rehearsed.rows[rehearsed.rows["state"] == 2][:10_000]
    columns = {name: rows[name] for name in rows.dtype.names}
    return columns, of_bundle(Bundle(columns, rehearsed.case, Path("x"), {}))


def test_readings_in_chunks_equal_the_record(first):
    columns, record = first
    readings = Readings(record, columns, False)
    parts = [readings.take({n: v[k : k + 777] for n, v in columns.items()}) for k in range(0, 10_000, 777)]
    np.testing.assert_allclose(np.concatenate([p[1][:, 0] for p in parts]), record.y[readings.sensors[0]], atol=1e-12)
    np.testing.assert_allclose(np.concatenate([p[0] for p in parts]), record.u)


def test_wrapping_counter_is_unwrapped_across_chunks(first):
    columns, record = first
    readings = Readings(record, columns, False)
    name = record.case.machine.sensors[readings.sensors[0]].column
    counts = np.asarray(columns[name]).astype(np.int64) + 2**23 - 100
    wrapped = (counts + 2**23) % 2**24 - 2**23  # reading of a 24-bit counter
    assert np.ptp(wrapped) > 2**22
    parts = [
        readings.take({**{n: v[k : k + 500] for n, v in columns.items()}, name: wrapped[k : k + 500]})[1][:, 0]
        for k in range(0, 10_000, 500)
    ]
    y = np.concatenate(parts)
    assert np.abs(np.diff(y)).max() < 0.1
    np.testing.assert_allclose(y - y[0], record.y[readings.sensors[0]] - record.y[readings.sensors[0]][0], atol=1e-9)


def test_columns_that_differ_from_the_record_are_refused(first):
    columns, record = first
    with pytest.raises(UserError, match="row by row"):
        Readings(record, {**columns, "u1": columns["u1"] * 1.01}, False)
