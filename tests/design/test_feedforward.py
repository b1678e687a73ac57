import fused
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.design import feedforward


def test_feedforward_values_of_the_reel_unit():
    """8.4: slightly less than the lowest friction; J of a motor with its reel."""
    found = {value.path: value.value for value in feedforward.design(fused.config("ivu"))}
    assert found["law.friction.motor1.tau_C"] == pytest.approx(2.4e-3, rel=0.05)
    assert found["law.friction.motor1.tau_C"] < 2.4e-3
    assert found["law.inertia.J"] == pytest.approx(1.5e-3 + (1.91e-4 + 8.3e-6) / 2, rel=0.01)


def test_feedforward_values_of_the_linear_drive():
    """(12.3): 14 N per volt; 12.6: break-away at 0.93 and 0.88 V, above the offset of the amplifier."""
    found = {value.path: value.value for value in feedforward.design(fused.config("ldu"))}
    assert found["law.friction.newton_per_volt"] == pytest.approx(14.0)
    assert found["law.friction.F_c"] == pytest.approx(7.1, rel=0.01)


def test_feedforward_reduces_the_tracking_error_of_the_reel_unit():
    """Figure 12.10: tracking error, and the tension variation by the inertia."""
    worth = feedforward.worth(fused.config("ivu", "steps"), 6.5)
    assert worth.tracking[1] < 0.4 * worth.tracking[0]
    assert worth.final[1] < worth.final[0]
    assert worth.tension[1] < 0.6 * worth.tension[0]


def test_feedforward_reduces_the_tracking_error_of_the_linear_drive():
    worth = feedforward.worth(fused.config("ldu", "print_steps"), 1.6)
    assert worth.tracking[1] < 0.3 * worth.tracking[0]
    assert worth.final[1] < 5e-6 < worth.final[0]
    assert np.isnan(worth.tension).all()


def test_computed_torque_of_the_linear_drive():
    """Force for one kilogram more or less of moving mass, by the rigid sums."""
    volts = feedforward.computed_torque(fused.config("ldu"))
    mass = 1.25 + (1e-6 * 400 + 1e-5 + 1e-7 + 3e-6) / 9e-6
    assert volts == pytest.approx(mass / 14.0, rel=1e-3)


def test_computed_torque_reduces_the_error_of_a_fast_reference():
    config = fused.config("ldu", "print_steps", law__shaper__bandwidth=250.0)
    values = feedforward.design(config)
    friction = [value for value in values if value.path != "law.inertia.volts"]
    both, one = (feedforward.worth(config, 1.6, given).tracking[1] for given in (values, friction))
    assert both < 0.85 * one


def test_axis_has_no_feedforward_design():
    with pytest.raises(UserError, match="axis has no feedforward"):
        feedforward.design(fused.config("axis"))


def test_reference_without_rest_is_refused():
    with pytest.raises(NoAnswer, match="never rests"):
        feedforward.worth(fused.config("ldu"), 0.5)
