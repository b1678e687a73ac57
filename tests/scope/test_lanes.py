"""Lanes of a model: fixed delay, overlapping reports, and a restart with another run."""

import numpy as np
import pytest

from rtctl.scope.history import History
from rtctl.scope.lanes import DELAY, Lanes


def told(t, values):
    return {"t": t, "lanes": {"missing_a": {"unit": "Nm", "values": values}}}


def test_lane_values_have_a_fixed_delay():
    lanes = Lanes()
    lanes.take(told([1.0, 2.0], [1.0, 2.0]))
    lanes.take(told([2.0, 3.0], [9.0, 3.0]))  # the repeated time of 2 s is ignored
    t = np.array([0.0, 1.0, 2.0, 2.5, 3.0]) + DELAY
    np.testing.assert_allclose(lanes.at(t, lanes.names)["missing_a"], [0.0, 1.0, 2.0, 2.5, 3.0])
    assert [(s["name"], s["unit"]) for s in lanes.signals] == [("missing_a", "Nm")]


def test_lanes_restart_with_another_run():
    lanes = Lanes()
    lanes.take(told([100.0, 101.0], [5.0, 5.0]))
    lanes.take(told([1.0, 2.0], [1.0, 2.0]))
    assert lanes.at(np.array([1.5 + DELAY]), ["missing_a"])["missing_a"] == pytest.approx(1.5)


def test_no_report_gives_no_lane():
    lanes = Lanes()
    lanes.take(None)
    lanes.take({"t": [], "lanes": {}})
    assert lanes.names == ()


def test_history_accepts_signals_in_addition_to_the_rows():
    row = np.dtype([("tick", np.int64), ("u", float)])
    history = History(row, 4)
    rows = np.array([(k, float(k)) for k in range(3)], row)
    history.append(rows)
    history.extend(("lane", "u"))
    assert history.names == ("tick", "u", "lane")
    history.append(np.array([(k, float(k)) for k in range(3, 6)], row), {"lane": np.array([0.1, 0.2, 0.3])})
    np.testing.assert_allclose(history.take(("u", "lane"), 0, 6), [[2.0, 3.0, 4.0, 5.0], [0.0, 0.1, 0.2, 0.3]])
