"""Stability margins with the delays and lags of effects."""

import numpy as np
import pytest

from rtctl.config.load import set_paths
from rtctl.improve import margins


def with_effect(config, entry):
    return set_paths(config, {"plant.physics": [entry]})


DELAY = {"term": "timing.delay", "node": "loop", "extra": 0.004}


def test_delay_reduces_the_phase_margin_by_its_phase(with_sizes):
    config = with_sizes()
    plain, late = margins.of_config(config), margins.of_config(with_effect(config, DELAY))
    assert plain.PM - late.PM == pytest.approx(360 * 0.004 * plain.f_PM, rel=0.02)
    assert late.f_PM == pytest.approx(plain.f_PM, rel=1e-3)


def test_pulse_response_measures_a_delay(with_sizes):
    config = with_effect(with_sizes(), DELAY)
    entry = config.plant.physics[0]
    assert margins.delay(entry, "command", config) == pytest.approx(0.004, abs=3e-4)
    assert margins.delay(entry, "reading", config) == 0.0


def test_pulse_response_measures_a_lag(with_sizes):
    config = with_effect(with_sizes(), {"term": "drive.lag", "node": "amplifier", "tau": 0.006})
    entry = config.plant.physics[0]
    assert margins.delay(entry, "command", config) == pytest.approx(0.006, rel=0.1)
    f = np.array([5.0, 20.0])
    chain = margins.Chain(config)(f)
    np.testing.assert_allclose(np.abs(chain), 1 / np.hypot(1.0, 2 * np.pi * f * 0.006), rtol=0.03)


def test_static_effect_does_not_change_the_margins(with_sizes):
    assert margins.of_config(with_sizes(dry=3.0)) == margins.of_config(with_sizes())


def test_integral_and_disturbance_observer_reduce_the_phase_margin(with_sizes):
    config = with_sizes()
    plain = margins.of_config(config)
    more = {
        "law.compensation.integral": {"gain": 60.0},
        "law.compensation.observer": {"bandwidth": 4.0, "acceleration": 121.0},
    }
    for path, value in more.items():
        found = margins.of_config(set_paths(config, {path: value}))
        assert found.PM < plain.PM - 3.0
        assert found.stable


def test_observer_with_share_zero_keeps_the_phase_margin(with_sizes):
    config = with_sizes()
    off = {"law.compensation.observer": {"bandwidth": 4.0, "acceleration": 121.0, "share": 0.0}}
    assert margins.of_config(set_paths(config, off)).PM == pytest.approx(margins.of_config(config).PM)


def test_predictor_restores_the_phase_margin_of_a_delay(with_sizes):
    stiff = {"machine.joints.belt.stiffness": 1e9, "law.velocity.filter": 40.0}
    late = set_paths(with_effect(with_sizes(), {**DELAY, "extra": 0.01}), stiff)
    ahead = {"law.compensation.predictor": {"delay": 11, "acceleration": 121.0}}
    assert margins.of_config(set_paths(late, ahead)).PM > margins.of_config(late).PM + 10.0
