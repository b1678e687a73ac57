"""Tape tension as a remedy, for a machine whose law sets a tension."""

import pytest

from rtctl import api
from rtctl.improve.found import of_config
from rtctl.improve.ground import Ground
from rtctl.improve.proposals import tension

SLACK = {"term": "tape.slack", "node": "tape1"}
LONGER = {"term": "tape.path_length", "node": "path", "excess": "5.9 mm"}


def proposed(name, entry):
    found = of_config(api.load_config(name, {"plant.physics": [entry]}), "told")
    return tension(Ground(found, None, None, None, (0.0, 1.0)), found.effects[0])


def test_remedy_tries_tensions_around_the_present_tension():
    remedy = proposed("ivu", SLACK)
    assert [way["law.tension.F_t"] for way in remedy.ways] == [pytest.approx(0.1 * f) for f in (2.0, 1.5, 3.0, 0.7)]


def test_machine_without_a_tension_setting_has_no_tension_remedy():
    assert proposed("ivu-old", LONGER) is None
