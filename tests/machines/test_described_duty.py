"""Nominal duty of a described machine, from its reference."""

import pytest

from rtctl.cli.common import load_config
from rtctl.config.load import set_paths
from rtctl.machines.described_duty import duty


@pytest.fixture(scope="module")
def belt():
    return load_config("configs/machines/belt.yaml", [])


def test_nominal_travel_of_a_node_scales_with_its_ratio(belt):
    found = duty(belt)
    assert (found.speed, found.travel) == (15.0, 12.0)
    carriage, motor = (found.use(node, belt) for node in ("carriage", "encoder"))
    assert carriage.speed == pytest.approx(15.0 * 12.7e-3) and carriage.slides
    assert motor.travel == pytest.approx(12.0) and not motor.slides
    assert carriage.force * 12.7e-3 == pytest.approx(motor.force)
    assert carriage.dry == 3.0
    assert found.use("belt", belt).stiffness == 80e3


def test_nominal_command_is_force_over_gain(belt):
    found = duty(belt)
    assert found.volts(belt) == pytest.approx(found.use("motor", belt).force / 0.03)


def test_config_without_a_reference_has_no_nominal_duty(belt):
    with pytest.raises(ValueError, match="it does not move"):
        duty(set_paths(belt, {"reference": {}}))
