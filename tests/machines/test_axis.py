"""The shipped axis, run fused."""

from typing import Any

import fused
import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.tick import safety

SETPOINTS: dict[str, Any] = {
    "reference__steps": [{"at": 0.2, "to": 0.1, "ramp": 0.2}, {"at": 2.0, "to": 0.0, "ramp": 0.2}]
}


@pytest.fixture(scope="module")
def run() -> fused.Run:
    return fused.run(fused.config("axis", **SETPOINTS), 4.0)


def test_axis_follows_a_ramp_and_stops_at_the_target(run):
    assert run["trip"].max() == 0
    assert run["state"][-1] == safety.RUNNING
    for begin, target in ((1.5, 0.1), (3.5, 0.0)):
        assert run.between(begin, begin + 0.4)["truth_x"] == pytest.approx(target, abs=2e-4)
    speed = run.between(0.5, 0.69)["truth_speed"]
    assert speed.mean() == pytest.approx(0.2, rel=0.05)
    assert speed.max() < 0.22


def test_axis_encoder_counts_micrometres(run):
    assert np.abs(run["x"] - run["truth_x"]).max() < 1.1e-6
    assert run["x"] == pytest.approx(run["x_counts"] * 1e-6, abs=1e-12)


def test_steady_state_error_is_bounded_by_friction_over_gain(run):
    """Without an integral the axis stops where the proportional force equals the dry friction."""
    error = run.between(1.8, 2.0)["position_error"]
    assert np.abs(error).max() <= 20.4 / 35.15 / 39e3 + 2e-6


def test_unknown_key_is_an_error():
    with pytest.raises(UserError, match="gian"):
        fused.config("axis", law__position__gian=1.0)
