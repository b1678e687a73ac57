import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.laws import error_table


def build(values, period=1e-2):
    return error_table.build(error_table.ErrorTableSettings(period=period, values=values), 1e-4)


def test_error_table_interpolates_linearly_between_its_values():
    p = build([0.0, 1e-6, 3e-6, -2e-6])
    for x, e in ((0.0, 0.0), (2.5e-3, 1e-6), (5e-3, 3e-6), (3.75e-3, 2e-6), (8.75e-3, -1e-6)):
        assert error_table.step(p, x) - x == pytest.approx(e, abs=1e-15)


@given(st.floats(-5.0, 5.0), st.integers(-300, 300))
def test_error_table_is_periodic_on_both_sides_of_zero(x, turns):
    p = build([1e-6, -2e-6, 5e-7])
    moved = error_table.step(p, x + turns * 1e-2) - (x + turns * 1e-2)
    assert moved == pytest.approx(error_table.step(p, x) - x, abs=1e-11)


@given(st.floats(-1.0, 1.0))
def test_correction_stays_within_the_table_values(x):
    p = build([1e-6, -2e-6, 5e-7])
    assert -2e-6 - 1e-15 <= error_table.step(p, x) - x <= 1e-6 + 1e-15


def test_error_table_reads_its_parameters_from_a_record(record):
    p = build(list(1e-6 * np.sin(2 * np.pi * np.arange(64) / 64)))
    assert error_table.step(record(p), 2.5e-3) == error_table.step(p, 2.5e-3) == pytest.approx(2.501e-3)


@pytest.mark.parametrize("change", [{"values": [1e-6]}, {"values": [0.0] * 257}, {"period": 0.0}])
def test_invalid_error_table_is_refused(change):
    with pytest.raises(ValidationError):
        error_table.ErrorTableSettings(**{"period": 1e-2, "values": [0.0, 1e-6], **change})
