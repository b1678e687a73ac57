import numpy as np
import pytest

from rtctl import machines
from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find
from rtctl.diagnose.answer.nominal_duty import measure, rms_volts, use


@pytest.fixture
def config():
    return lambda kind, *changes: load_settings(find(kind), machines.CONFIGS[kind], changes)


def test_duty_of_tape_and_reel_is_consistent(config):
    ivu = config("ivu")
    capstan, reel, tape = (use(node, ivu) for node in ("capstan", "reel1", "tape1"))
    assert reel.speed * 0.038 == pytest.approx(capstan.speed * 0.0125)
    assert tape.speed == pytest.approx(capstan.speed * 0.0125)
    assert tape.force * 0.038 == pytest.approx(reel.force)


def test_duty_conserves_power_through_a_gear(config):
    ldu = config("ldu")
    motor, wheel, carriage = (use(node, ldu) for node in ("motor", "wheel", "carriage"))
    power = carriage.force * carriage.speed
    assert motor.force * motor.speed == pytest.approx(power)
    assert wheel.force * wheel.speed == pytest.approx(power)
    assert motor.speed == pytest.approx(20 * wheel.speed)


def test_rms_command_is_within_the_drive_limit(config):
    for kind in ("ivu", "ldu", "axis"):
        machine = config(kind)
        assert 0.01 * machine.law.limit.high < rms_volts(machine) < 0.5 * machine.law.limit.high


def test_measures_of_nodes(config):
    axis = config("axis")
    u = use("carriage", axis)
    assert measure("drag", "carriage", axis) == pytest.approx(u.force / u.speed)
    assert measure("tick", "loop", axis) == 1e-3
    assert measure("turn", "sensor", axis) == pytest.approx(u.travel / 7)
    assert measure("turn", "encoder", config("ivu")) == pytest.approx(2 * np.pi)
