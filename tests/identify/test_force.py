"""Volts into forces: the tape of the reel unit, the amplifier's curve of the linear drive."""

import bench_runs as runs
import numpy as np
import pytest

from rtctl.identify import force


def test_force_of_the_reel_unit():
    record = runs.made(
        "ivu", {"u1": np.full(3, 1.0), "u2": np.full(3, 0.5), "R1": np.full(3, 0.03), "R2": np.full(3, 0.02)}
    )
    K = 0.061 * 0.2
    assert force.tape_force(record) == pytest.approx(K * (1 / 0.03 - 0.5 / 0.02))
    assert force.friction_force(record) == pytest.approx(force.tape_force(record) / (1 / 0.03 + 1 / 0.02))


def test_force_through_the_measured_amplifier():
    """(12.3): below 0.8 V it is 0.042 A in the direction of the bit, which -0.0 V tells."""
    u = np.array([0.0, -0.0, 0.93, -0.88, 1.8])
    record = runs.made("ldu_printer", {"u": u}, 1e-4)
    ampere = np.array([0.042, -0.042, 0.055, -0.05, 0.142])
    N_K = 21e-3 * 20 / 3.0018e-3
    assert force.carriage_force(record) == pytest.approx(ampere * N_K)
    assert force.friction_force(record) == pytest.approx([0.8, -0.8, 0.93, -0.88, 1.8])
    assert np.array_equal(force.written_force(record), u)


def test_force_through_the_linear_amplifier():
    record = runs.made("ldu", {"u": np.array([0.0, 0.5, -1.0])}, 1e-4)
    assert force.carriage_force(record) == pytest.approx([0.0, 7.0, -14.0])
    assert force.friction_force(record) == pytest.approx([0.0, 0.5, -1.0])
