import numpy as np
import pyarrow as pa
import pytest
from trace_rows import COLUMNS, ROW, is_truth, make

from rtctl.trace.columns import Column, columns_of, record_batch, schema


def test_unit_and_help_are_in_the_metadata_of_each_field():
    field = schema(COLUMNS, ROW, {"case": "{}"}).field("ref")
    assert field.metadata == {b"unit": b"rad", b"help": b"position reference"}
    assert field.type == pa.float64()
    assert schema(COLUMNS, ROW, {"case": "{}"}).metadata == {b"case": b"{}"}


def test_columns_survive_a_round_trip():
    assert columns_of(schema(COLUMNS, ROW)) == list(COLUMNS)
    assert columns_of(pa.schema([("x", pa.int8())])) == [Column("x", "", "")]


def test_batch_holds_the_rows_bit_exact():
    rows = make(5, 9)
    assert is_truth(record_batch(rows, schema(COLUMNS, ROW)), range(5, 14))
    assert is_truth(record_batch(rows[::2], schema(COLUMNS, ROW)), range(5, 14, 2))


@pytest.mark.parametrize(
    ("columns", "dtype", "words"),
    [
        ([Column("speed", "rad/s", "")], ROW, "'speed' is not in the row; it has tick, t"),
        ([COLUMNS[1], COLUMNS[1]], ROW, "named twice: t"),
        ([Column("x", "m", "")], np.dtype([("x", "f8", (4,))]), "'x' is not a scalar"),
    ],
)
def test_unrecordable_columns_are_refused(columns, dtype, words):
    with pytest.raises(ValueError, match=words):
        schema(columns, dtype)
