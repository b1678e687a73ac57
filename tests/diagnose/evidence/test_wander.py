import numpy as np
import pytest
from graph_cases import PENDULUM, RATE, case_of, command, nothing, record

from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.calibration import UNEXPLAINED
from rtctl.diagnose.evidence.wander import log_density, wandering
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together

FORCE = 0.4  # Nm, rms drive torque


def random_force(n, rms, seed=3):
    """Random force (n,) with a correlation time of 0.2 s."""
    white = np.random.default_rng(seed).standard_normal(n + 400)
    slow = np.convolve(white, np.exp(-np.arange(400) / (0.2 * RATE)), "valid")[:n]
    return rms * slow / slow.std()


def test_nominal_machine_has_a_small_unexplained_share():
    base = nothing().found.base
    found = wandering(base)
    assert found.share < 3 * UNEXPLAINED
    assert 0.0 < found.noise < UNEXPLAINED


def test_random_force_is_estimated_over_time():
    u = command(4.0)
    push = random_force(len(u), 0.1 * FORCE)
    like, space = together([record(case_of(PENDULUM), u, push=push)])
    fit = refit(like, space)
    free = wandering(fit).free
    assert free is not None
    assert (free.node, free.axis) == ("rod", "time")
    there = np.interp(free.knots, np.arange(len(u)) / RATE, push)
    assert np.corrcoef(free.value, there)[0, 1] > 0.7
    assert free.value.std() == pytest.approx(there.std(), rel=0.4)


@pytest.mark.long
def test_random_force_gives_an_unnamed_verdict():
    u = command(4.0)
    d = diagnose_record(record(case_of(PENDULUM), u, push=random_force(len(u), 0.15 * FORCE)))
    assert d.verdict == "unnamed"


def test_prior_density_of_the_unexplained_share():
    values = np.linspace(0.0, 0.1, 2001)
    density = np.exp([log_density(v, UNEXPLAINED) for v in values])
    mean = np.sqrt(np.sum(density * values**2) / np.sum(density))
    assert mean == pytest.approx(UNEXPLAINED, rel=0.01)


def test_sensor_noise_is_not_a_random_force():
    u = command(4.0)
    made = record(case_of(PENDULUM), u)
    noisy = made._replace(y={"encoder": made.y["encoder"] + 4e-3 * np.random.default_rng(4).standard_normal(len(u))})
    like, space = together([noisy])
    fit = refit(like, space)
    found = wandering(fit)
    assert found.share > 2 * UNEXPLAINED
    assert found.noise == pytest.approx(found.share, rel=0.4)
    assert diagnose_record(noisy).verdict == "nothing"
