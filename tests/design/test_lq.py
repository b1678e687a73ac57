"""State feedback by LQ for described machines."""

import numpy as np
import pytest

from rtctl.api import load_config
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path
from rtctl.design import lq, margins, response, systems, tune

LEAST = (6.0, 45.0)


@pytest.fixture(scope="module")
def belt():
    return load_config("machines/belt")


@pytest.fixture(scope="module")
def tuned(belt):
    return tune.tune(belt, method="lq")


def test_lq_loop_is_stable_with_its_margins_in_discrete_time(tuned):
    found = margins.of_config(tuned.config)
    assert abs(found.GM) >= LEAST[0] and found.PM >= LEAST[1]
    assert np.abs(systems.poles(tuned.config)).max() < 1.0
    assert found.M_S < tuned.before.M_S  # than the shipped PD


def test_lq_closes_the_loop_on_a_sensor_beyond_a_compliance(belt):
    far = set_path(belt, "law", {"feedback": "scale", "drive": "amplifier"})
    found = lq.design(far, LEAST)
    assert found.crossover > 3.0
    assert np.abs(systems.poles(found.config)).max() < 1.0


def test_machine_with_a_speed_sensor_only_has_no_position_state():
    spindle = load_config("machines/spindle")
    start = response.take(set_path(spindle, "law.position", {"kind": "pd", "gain": 1.0}))
    assert len(lq.sampled(start).B) < len(start.model.A) + start.delay
    assert np.abs(systems.poles(lq.design(spindle, LEAST).config)).max() < 1.0 + 1e-9


def test_bandwidth_beyond_the_limit_of_the_delay_has_no_answer(belt):
    with pytest.raises(NoAnswer, match="no state feedback from encoder to amplifier"):
        lq.design(belt, LEAST, 90.0)


def test_other_machines_and_other_methods_are_refused(belt):
    with pytest.raises(UserError, match="for machines that a config describes"):
        tune.tune(load_config("ivu"), method="lq")
    with pytest.raises(UserError, match="usual or lq"):
        tune.tune(belt, method="lqg")
