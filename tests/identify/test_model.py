"""Model of a fit: equal to the design model at the radii of the response."""

import frf_runs
import numpy as np
import pytest

from rtctl.design import response
from rtctl.identify import model
from rtctl.identify.frf import Frf

F = np.geomspace(0.5, 100.0, 40)


def at(kind: str, motor: int = 1, R1: float = 0.038, R2: float = 0.022, per_ampere: bool = False) -> Frf:
    dt = 0.002 if kind == "ivu" else 1e-4
    return Frf(F, np.ones(40) + 0j, np.ones(40), kind, motor, R1, R2, dt, 1.0, per_ampere)


@pytest.mark.parametrize("kind, motor", [("ivu", 1), ("ivu", 2), ("ldu", 1)])
def test_fit_model_is_the_plant_with_its_hold(kind, motor):
    config = frf_runs.config(kind)
    parts = response.take(config, motor)
    wanted = response.plant_response(parts.model, F) * response.hold(parts, F)
    got = model.Model(config, ()).response({}, at(kind, motor), 1.5 * parts.dt)
    np.testing.assert_allclose(got, wanted, rtol=1e-9)


def test_fit_model_scales_the_inertias_with_the_radii():
    wanted = response.plant(frf_runs.reels(0.03, 0.034), F)
    got = model.Model(frf_runs.config(), ()).response({}, at("ivu", 1, 0.03, 0.034), 0.003)
    hold = np.sinc(F * 0.002) * np.exp(-2j * np.pi * F * 0.003)
    np.testing.assert_allclose(got, wanted * hold, rtol=1e-9)


def test_parameter_without_a_side_sets_both_sides():
    tied = model.Model(frf_runs.config(), ("c",)).settings({"c": 500.0})
    assert (tied.parameters.c1, tied.parameters.c2) == (500.0, 500.0)
    one = model.Model(frf_runs.config(), ("c1",)).settings({"c1": 500.0})
    assert (one.parameters.c1, one.parameters.c2) == (500.0, 450.0)


def test_process_gain_is_that_of_the_thesis():
    """8.2: K_p = 25.4 at 1 Hz; the equations give 25.6."""
    assert model.Model(frf_runs.config(), ()).process_gain({}, at("ivu")) == pytest.approx(25.4, rel=0.03)
