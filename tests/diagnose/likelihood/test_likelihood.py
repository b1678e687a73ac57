from functools import cache

import numpy as np
import pytest
from graph_cases import BELT, case_of, command, nothing, record

from rtctl.diagnose.likelihood.likelihood import QUANTISED, RATE, Likelihood, averaged
from rtctl.diagnose.model.model import nominal, settings_of
from rtctl.diagnose.model.simulate import Simulator

RUB = {"term": "friction.coulomb", "node": "carriage", "F_C": 2.0}


@cache
def like():
    return Likelihood(Simulator(record(case_of(BELT), command(0.6), [RUB])))


def model(force):
    return nominal(like().sim.case).add(settings_of({**RUB, "F_C": force}))


def test_residual_of_the_true_model_is_quantisation_noise():
    e = like().raw(model(2.0))
    np.testing.assert_allclose(e.std(axis=0), QUANTISED / np.array([1300.0, 2e5]), rtol=0.6)
    assert like().mean == round(like().sim.record.dt ** -1 / RATE)


def test_loss_is_minimal_at_the_true_value():
    losses = {force: like().loss(like().raw(model(force))) for force in (1.0, 1.8, 2.0, 2.2, 3.0)}
    assert min(losses, key=losses.get) == 2.0
    assert losses[3.0] > losses[2.2] > losses[2.0]


def test_innovations_under_the_fitted_noise_are_white_with_unit_variance():
    e = like().raw(model(0.0))
    own = like().told(e)
    white = own.white(e)
    (slow,) = own.slow
    assert len(white) == own.size + len(slow.of(e))
    np.testing.assert_allclose(np.mean(white[: own.size] ** 2), 1.0, rtol=0.3)
    np.testing.assert_allclose(own.white(e[:, :, None])[:, 0], white)


def test_likelihood_of_a_row_range():
    part = like().during(1000, 1500)
    assert part.rows == (1000, 1500)
    np.testing.assert_allclose(part.raw(model(2.0))[:, 0], like().raw(model(2.0))[1000 - like().rows[0] :][:500, 0])


def test_offset_of_a_second_counter_does_not_affect_the_residual():
    out = like().sim.run(model(2.0))
    moved = out + np.array([0.0, 0.01])
    np.testing.assert_allclose(like().of_readings(moved), like().of_readings(out), atol=1e-12)
    forced = out + np.array([0.01, 0.0])
    assert np.abs(like().of_readings(forced)[:, 0]).mean() == pytest.approx(0.01, rel=0.05)


def test_divergent_model_has_a_larger_loss():
    out = like().sim.run(model(2.0)).copy()
    out[1200:] = np.nan
    assert like().loss(like().of_readings(out)) > like().loss(like().raw(model(0.0)))


def test_segment_losses_sum_to_the_loss():
    e = like().raw(model(0.0))
    assert like().losses(e, 7).sum() == pytest.approx(like().loss(e))
    e = np.random.default_rng(0).standard_normal(e.shape)
    quiet = like().losses(e, 4)
    e[: len(e) // 4] *= 3.0
    assert np.argmax(like().losses(e, 4)) == 0
    assert np.ptp(quiet) < 0.2 * np.ptp(like().losses(e, 4))


def test_flat_noise_has_the_level_of_the_residual():
    e = like().raw(model(0.0))
    white = like().flat(e).white(e)[: e.size]  # without the slow residuals
    assert like().flat(e).size == e.size  # no autoregression: least squares
    np.testing.assert_allclose(white.reshape(e.shape[1], -1).std(axis=1), 1.0)
    least = like().flat(np.zeros_like(e))
    np.testing.assert_allclose([noise.sigma for noise in least.noise], like().least)


def test_no_noise_model_explains_a_divergent_model():
    """Also an autoregression, which could predict a residual of constant size and alternating sign, does not."""
    out = like().sim.run(model(2.0))
    right = like().loss(like().of_readings(out))
    for begin in (0, len(out) // 2):
        lost = out.copy()
        lost[begin:] = np.nan
        assert like().loss(like().of_readings(lost)) > right + 1000.0


def test_predictive_loss_of_louder_rows_grows_with_the_log_of_their_level():
    base = nothing().found.base
    first, late = base.like.split(0.25)
    before = first.noisy(first.raw(base.model))
    e = late.raw(base.model)
    one, ten = late.foretold(10.0 * e, before), late.foretold(100.0 * e, before)
    assert ten - one == pytest.approx(late.noisy(e).size * np.log(10.0), rel=0.1)
    assert late.foretold(e, before) < one


@pytest.mark.parametrize("count", [1, 2, 7])
def test_adjacent_rows_are_averaged(count):
    x = np.random.default_rng(2).standard_normal(42)
    np.testing.assert_allclose(averaged(x, count), x.reshape(-1, count).mean(axis=1), rtol=1e-14)
