import described_machines as machines
import numpy as np
import pytest
from graph_cases import PENDULUM, case_of, command, nothing, record

from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.pushes import answer, averaged, pushes
from rtctl.diagnose.model.model import nominal

WIDTH = 50


def test_windowed_mean_of_a_line_is_its_midpoint_value():
    rows = np.arange(1000.0)[:, None]
    found = averaged(np.hstack([rows, 0.0 * rows + 3.0]), WIDTH)
    assert found.shape == (19, 2)
    assert found[:, 0] == pytest.approx(WIDTH * np.arange(1, 20), abs=1e-9)
    assert found[:, 1] == pytest.approx(3.0)


def test_short_record_has_no_windows():
    assert averaged(np.ones((2 * WIDTH - 1, 1)), WIDTH).shape == (0, 1)


def test_windows_attenuate_the_noise_of_a_fast_observer():
    dt = 1e-3
    quick = answer(500.0, dt, 100)
    assert quick < 500.0**2 / np.sqrt(100) / 50  # a box average would attenuate less


def test_observer_correction_estimates_the_missing_force():
    u = command(4.0)
    like, _ = together([record(case_of(PENDULUM), u, push=0.05 * np.ones(len(u)))])
    slow = pushes(like, nominal(like.sim.case))[0]
    assert slow.shape == (len(slow), 1)
    assert np.mean(slow) == pytest.approx(0.05, rel=0.1)


def test_fit_stores_the_corrections_of_its_observer():
    base = nothing().found.base
    (slow,) = base.pushes
    assert len(slow) > 10
    assert np.abs(slow).max() < 0.02


def test_body_with_prescribed_motion_has_no_correction():
    turn = 20.0 * np.sin(2 * np.pi * 0.2 * np.arange(400) / 50.0)
    case = machines.case_of(machines.SCREW, 50.0, problem="kinematic")
    like, _ = together([machines.record(case, turn=turn, way=8e-4 * turn)])
    assert pushes(like, nominal(like.sim.case))[0].shape == (0, 1)
