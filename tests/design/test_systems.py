import control
import fused
import numpy as np
import pytest

from rtctl.api import load_config
from rtctl.config.load import set_path
from rtctl.design import response, systems


@pytest.mark.parametrize("name", ["ivu", "ldu", "axis"])
def test_sampled_loop_agrees_with_the_continuous_loop(name):
    """Images beyond half the sample rate change the response at low frequency by a fraction of a percent."""
    config = fused.config(name)
    P, K, _ = systems.sampled(config)
    f = np.geomspace(0.02, 1, 20) * 0.1 / P.dt
    z = np.exp(2j * np.pi * f * P.dt)
    np.testing.assert_allclose((P * K)(z), response.loop(config, f), rtol=5e-3)
    np.testing.assert_allclose(systems.closed(config)(z), response.closed(config, f), rtol=5e-3)
    np.testing.assert_allclose(K(z), response.law(config, f), rtol=1e-6)


def test_step_response_agrees_with_the_run():
    """A small step of the axis without friction, to the count."""
    config = fused.config("axis", law__shaper__bandwidth=None, plant__parameters__F_c=0.0)
    config = config.model_copy(update={"reference": type(config.reference)(steps=[{"at": 0.2, "to": 1e-4}])})
    rows = fused.run(config, 1.0).between(0.2, 0.6)
    t = rows["t"] - rows["t"][0]
    _, y = control.step_response(systems.closed(config), T=np.round(t / 1e-3) * 1e-3)
    np.testing.assert_allclose(rows["truth_x"], 1e-4 * y, atol=2.5e-6)


def test_write_at_the_same_tick_has_one_state_less():
    late, soon = (systems.sampled(fused.config("ivu", loop__write=w))[0] for w in ("next_tick", "same_tick"))
    assert late.nstates == soon.nstates + 1


@pytest.mark.parametrize(
    "around",
    [
        {"integral": {"gain": 20.0}},
        {"observer": {"bandwidth": 8.0, "acceleration": 320.0, "delay": 1}},
        {"observer": {"bandwidth": 8.0, "acceleration": 320.0, "delay": 0}},
        {"predictor": {"delay": 2, "acceleration": 320.0}},
        {"integral": {"gain": 20.0}, "observer": {"bandwidth": 5.0, "acceleration": 320.0}},
    ],
)
def test_sampled_law_includes_the_compensation(around):
    config = set_path(load_config("machines/belt"), "law.compensation", around)
    _, K, R = systems.sampled(config)
    f = np.geomspace(0.5, 0.4 * config.loop.rate, 20)
    z = np.exp(2j * np.pi * f / config.loop.rate)
    np.testing.assert_allclose(K(z), response.law(config, f), rtol=1e-6)
    np.testing.assert_allclose(R(z), response.law_response(response.take(config), f, "reference"), rtol=1e-6)
