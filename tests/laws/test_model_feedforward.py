"""Model feedforward on the machine of the model: tracking error, rms."""

import numpy as np
import pytest

from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import load_yaml
from rtctl.improve import played
from rtctl.machines import class_of


@pytest.fixture(scope="module")
def belt():
    path = "configs/machines/belt.yaml"
    return played.with_reference(load_settings(path, class_of(load_yaml(path).data), []))


def error(config, plant, **feedforward):
    """rms of the tracking error of the motor, rad."""
    law = set_paths(config, {"law.compensation.feedforward": feedforward}) if feedforward else config
    judge = played.judge_of(config, "motor")
    return played.play(law, plant, played.seconds_of(config), judge).figures.rms


NOTHING = {"inertia": 0.0, "friction": 0.0, "viscous": 0.0, "velocity": 0.0}


def test_feedforward_cancels_the_tracking_error_without_dry_friction(belt):
    free = set_paths(belt, {"machine.bodies.motor.dry": 0.0, "machine.bodies.carriage.dry": 0.0})
    without = error(free, free, **NOTHING)
    assert without == pytest.approx(error(free, free), rel=1e-12)
    assert error(free, free, lead=1.5e-3) < 0.1 * without


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_friction_share_reduces_the_tracking_error_in_proportion(belt, share):
    with_it = error(belt, belt, lead=1.5e-3, friction=share)
    assert with_it == pytest.approx((1.0 - share) * error(belt, belt, lead=1.5e-3, friction=0.0), rel=0.15)


def test_effect_in_the_feedforward_cancels_its_force(belt):
    spring = {"term": "load.spring", "node": "carriage", "k": 20.0}
    plant = set_paths(belt, {"plant.physics": [spring], "machine.bodies.motor.dry": 0.0})
    law = set_paths(plant, {"law.position.gain": 4.55})
    base = {"lead": 1.5e-3, "friction": 0.9}
    without = error(law, plant, **base, effects=[{"effect": spring, "share": 0.0}])
    assert error(law, plant, **base, effects=[{"effect": spring, "share": 1.0}]) < 0.2 * without


def test_feedforward_through_a_compliance_leads_by_the_deflection(belt):
    soft = set_paths(belt, {"machine.joints.belt.stiffness": 4000.0, "machine.bodies.motor.dry": 0.0})
    judge, seconds = played.judge_of(soft, "carriage"), played.seconds_of(soft)
    law = set_paths(soft, {"law.compensation.feedforward": {"lead": 1.5e-3, "friction": 1.0}})
    through = set_paths(law, {"law.compensation.feedforward.through": "carriage"})
    direct, ahead = (played.play(each, soft, seconds, judge).figures for each in (law, through))
    assert ahead.rms < 0.5 * direct.rms


def test_unknown_body_is_refused(belt):
    law = set_paths(belt, {"law.compensation.feedforward": {"through": "arm"}})
    with pytest.raises(ValueError, match="there is no body 'arm'; there is motor, carriage"):
        played.play(law, belt, 1.0, played.judge_of(belt))


def test_effect_without_a_force_or_a_command_change_is_refused(belt):
    scale = {"term": "sensor.scale", "node": "encoder", "relative": 0.01}
    with pytest.raises(Exception, match="neither adds a force nor changes a command"):
        set_paths(belt, {"law.compensation.feedforward": {"effects": [{"effect": scale}]}})


def test_config_without_compensation_adds_no_lines_to_the_tick(belt):
    from rtctl import machines
    from rtctl.loop.generate import source

    text = source(machines.build(belt), "shm")
    assert "feedforward" not in text and "u_integral" not in text
    assert np.isfinite(error(belt, belt))
