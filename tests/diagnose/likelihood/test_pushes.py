import described_machines as machines
import numpy as np
import pytest
from graph_cases import PENDULUM, case_of, command, nothing, record

from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.pushes import answer, averaged, pushes
from rtctl.diagnose.model.model import nominal

WIDTH = 50


def test_a_line_is_averaged_to_its_middle():
    rows = np.arange(1000.0)[:, None]
    found = averaged(np.hstack([rows, 0.0 * rows + 3.0]), WIDTH)
    assert found.shape == (19, 2)
    assert found[:, 0] == pytest.approx(WIDTH * np.arange(1, 20), abs=1e-9)
    assert found[:, 1] == pytest.approx(3.0)


def test_less_rows_than_a_window_are_none():
    assert averaged(np.ones((2 * WIDTH - 1, 1)), WIDTH).shape == (0, 1)


def test_a_quick_observer_pushes_with_noise_that_the_windows_take_off():
    dt = 1e-3
    quick = answer(500.0, dt, 100)
    assert quick < 500.0**2 / np.sqrt(100) / 50  # the mean over a box would leave the noise of a mean error


def test_a_missing_force_is_what_the_observer_pushes_with():
    u = command(4.0)
    like, _ = together([record(case_of(PENDULUM), u, push=0.05 * np.ones(len(u)))])
    slow = pushes(like, nominal(like.sim.case))[0]
    assert slow.shape == (len(slow), 1)
    assert np.mean(slow) == pytest.approx(0.05, rel=0.1)


def test_a_fit_knows_what_its_observer_pushed_with():
    base = nothing().found.base
    (slow,) = base.pushes
    assert len(slow) > 10
    assert np.abs(slow).max() < 0.02


def test_what_moves_as_it_was_recorded_is_not_pushed():
    turn = 20.0 * np.sin(2 * np.pi * 0.2 * np.arange(400) / 50.0)
    case = machines.case_of(machines.SCREW, 50.0, problem="kinematic")
    like, _ = together([machines.record(case, turn=turn, way=8e-4 * turn)])
    assert pushes(like, nominal(like.sim.case))[0].shape == (0, 1)
