"""Best linear approximation: synthetic machine with noise and distortion; emulated machines against their models."""

from dataclasses import replace

import frf_runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.design import response
from rtctl.identify import best_linear
from rtctl.identify.frf import CIRCLE_95
from rtctl.laws import excitation

RATE, N, PERIODS = 1000.0, 1000, 6
WAVE = {"kind": "multisine", "rms": 0.5, "f_min": 1.0, "f_max": 100.0, "period": N / RATE}


def machine(seed: int, noise: float = 0.0, square: float = 0.0, cube: float = 0.0):
    """y = u + square u^2 + cube u^3 + noise, in open loop."""
    p = excitation.build(excitation.MultisineSettings(**WAVE, seed=seed), 1 / RATE)
    u = 0.5 * np.tile(p.x[: p.n], PERIODS + 1)
    y = u + square * u**2 + cube * u**3 + noise * np.random.default_rng(seed).standard_normal(len(u))
    return frf_runs.made_up(u, y, u, {**WAVE, "seed": seed})


def identify(**size: float) -> best_linear.BestLinear:
    return best_linear.identify([machine(seed, **size) for seed in range(1, 9)])


def test_unit_gain_is_identified_exactly():
    found = identify()
    np.testing.assert_allclose(found.G, 1.0, atol=1e-9)
    assert found.realisations == 8 and found.periods == PERIODS - 1
    assert max(found.total.max(), found.odd.max(), found.even.max()) < 1e-9


def test_estimated_noise_deviation_agrees_with_the_noise():
    found = identify(noise=0.05)
    lines = np.sqrt(2 / len(found.f)) * 0.5 / 2  # amplitude of the input lines
    wanted = 0.05 / np.sqrt(N * (PERIODS - 1) * 8) / lines
    assert np.median(found.noise) == pytest.approx(wanted, rel=0.15)
    assert np.median(found.total) == pytest.approx(wanted, rel=0.25)
    assert np.mean(np.abs(found.G - 1) < CIRCLE_95 * found.total) > 0.85


def test_even_distortion_falls_between_the_excited_lines():
    found = identify(square=0.2)
    assert np.median(found.even) > 0.02
    assert np.median(found.odd) < 1e-9


def test_odd_distortion_varies_with_the_phases():
    found = identify(cube=0.2)
    assert np.median(found.odd) > 0.02
    assert np.median(found.even) < 1e-9
    assert np.median(np.abs(found.G)) == pytest.approx(1 + 3 * 0.2 * 0.25, rel=0.03)  # u^3 is 3 sigma^2 u on average


@pytest.mark.parametrize("name, motor", [("ivu", 1), ("ivu", 2), ("ldu", 1)])
def test_response_of_the_emulated_machines_agrees_with_their_models(name, motor):
    found = frf_runs.response(name, motor)
    parts = response.take(frf_runs.shipped(name, motor)[0].config, motor)
    H = response.plant_response(parts.model, found.f) * response.hold(parts, found.f)
    assert np.mean(np.abs(found.G - H) < CIRCLE_95 * found.total) > 0.9
    assert found.frf.motor == motor
    slow = found.f < 20.0
    np.testing.assert_allclose(found.G[slow], H[slow], rtol=0.06)


def test_two_records_with_equal_phases_are_refused():
    with pytest.raises(UserError, match="the seeds 1, 1 repeat"):
        best_linear.identify([machine(1), machine(1)])


def test_single_realisation_has_no_answer():
    with pytest.raises(NoAnswer, match="at least two"):
        best_linear.identify(machine(1))


def test_records_of_different_settings_are_refused():
    other = machine(2)
    longer = other.config.excitation.model_copy(update={"rms": 1.0})
    other = replace(other, config=other.config.model_copy(update={"excitation": longer}))
    with pytest.raises(UserError, match="must be those of"):
        best_linear.identify([machine(1), other])


def test_too_short_record_error_names_the_needed_length():
    records = [machine(seed) for seed in (1, 2)]
    short = [replace(r, columns={name: c[: 2 * N] for name, c in r.columns.items()}) for r in records]
    with pytest.raises(NoAnswer, match="three periods of 1 s are the least"):
        best_linear.identify(short)


def test_band_below_the_noise_is_named():
    records = [machine(seed, noise=20.0) for seed in range(1, 4)]
    with pytest.raises(NoAnswer, match=r"deviation of the response is above 50 % from \d+"):
        best_linear.identify(records, (1.0, 100.0))
