"""Step accuracy of the reel unit, and the old unit with its stepper motor."""

import numpy as np
import pytest

from rtctl.reproduce import accuracy09
from rtctl.reproduce.played import config, play


@pytest.mark.parametrize(("law", "counts", "most"), [("best", 10000, 0.03), ("coarse", 500, 0.2)])
def test_steps_end_near_their_target(law, counts, most):
    for R1, R2 in ((0.02, 0.04), (0.04, 0.02)):
        done = accuracy09.outcome(law, counts, R1, R2)
        assert not done.tripped and done.error < most and done.tension > -1e-9


def test_full_friction_hand_over_reduces_the_step_error():
    best, shipped = (accuracy09.outcome(law, 10000, 0.02, 0.04).error for law in ("best", "shipped"))
    assert best < 0.3 * shipped


def test_old_reel_unit_steps_in_open_loop():
    """The stepper moves in half steps; the camera measures the tape, not the motor."""
    run = play(config("ivu-old", {"reference": {"steps": [{"at": 0.5, "to": -0.5, "ramp": 1.6}]}}), 3.0)
    half = np.pi / 200
    asked = run["u"][run["state"] == run["state"][-1]] / half
    assert asked == pytest.approx(np.round(asked), abs=1e-6)
    assert run["image"][-1] == pytest.approx(0.0125 * run["truth_capstan"][-1], abs=2e-5)
    assert run["truth_capstan"][-1] == pytest.approx(-0.5, abs=half)
