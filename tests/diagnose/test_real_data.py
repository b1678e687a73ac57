"""Recordings of real machines, beside the project.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019); Wigren & Schoukens, Three free data sets
for development and benchmarking in nonlinear system identification, ECC 2013; github.com/gchenfc/ODrive,
analysis/cogging_torque, for the brushless motor.
"""

import numpy as np
import pytest

from rtctl.diagnose.answer.torque_ripple_map import over_turn
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.record.format1 import load_record


@pytest.fixture(scope="module")
def motors(real_data):
    return [load_record(real_data / f"bldc_slow_{k}") for k in range(3)]


def test_three_recordings_of_a_motor_give_equal_torque_ripple_maps(motors):
    turns = [over_turn(record, owner_model(record.case, record)) for record in motors]
    for found in turns:
        assert found.orders[0].order == 7.0
        assert found.orders[0].amplitude == pytest.approx(6.8e-3, rel=0.05)
        assert found.orders[0].share > 0.7
    known = np.logical_and.reduce([np.isfinite(found.torque) for found in turns])
    assert known.mean() > 0.85
    for one, two in ((0, 1), (0, 2), (1, 2)):
        off = (turns[one].torque - turns[two].torque)[known]
        assert np.std(off) < 0.05 * np.std(turns[one].torque[known])
