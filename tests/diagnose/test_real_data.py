"""Recordings of real machines, which lie beside the project where they are there at all.

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019); Wigren & Schoukens, Three free data sets
for development and benchmarking in nonlinear system identification, ECC 2013; github.com/gchenfc/ODrive,
analysis/cogging_torque, for the brushless motor.
"""

import numpy as np
import pytest

from rtctl.diagnose.kernel import OPEN
from rtctl.diagnose.measure import compare
from rtctl.diagnose.model import Model, owner_model
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.turn import over_turn

BEST = 2.64e-3  # m, rmse of a free run of EMPS under its command that others have published, of another recording
SILVERBOX = 0.301e-3  # V, the same of the Silverbox
AXIS = (
    "friction.coulomb", "friction.viscous", "friction.asymmetry", "drive.offset", "drive.gain_asymmetry", "load.spring",
)  # fmt: skip
OSCILLATOR = (
    "structure.stiffening", "load.spring", "friction.viscous", "drive.gain_asymmetry", "drive.offset",
)  # fmt: skip


def part(record: Record, rows: slice) -> Record:
    """Some of its rows."""
    arrays = {name: getattr(record, name)[rows] for name in ("t", "ref", "w", "u")}
    return record._replace(y={k: v[rows] for k, v in record.y.items()},
                           columns={k: v[rows] for k, v in record.columns.items()}, **arrays)  # fmt: skip


def free(record: Record, model: Model) -> float:
    """Rmse of the run under the recorded command, from the record's own beginning on, as `rtctl simulate` tells it."""
    return compare(record, model, OPEN, skip=50).channels["x"].rmse


def rmse(sim: Simulator, model: Model, mode: int, rows: slice) -> float:
    """Of the free run's position, m."""
    return float(np.sqrt(np.mean((sim.run(model, mode)[:, 0] - sim.seen)[rows] ** 2)))


PLAIN = ("friction.coulomb", "friction.viscous", "drive.offset")
TILTED = ("friction.coulomb", "friction.viscous", "friction.asymmetry")


@pytest.fixture(scope="module")
def motors(real_data):
    return [load_record(real_data / f"bldc_slow_{k}") for k in range(3)]


def test_three_recordings_of_a_motor_give_one_torque_over_the_turn(motors):
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
