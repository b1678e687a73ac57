"""Recordings that show a speed: its noise, its reading in the simulation, and a sensor that does not know direction."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose.case import read_case
from rtctl.diagnose.kernel import OPEN, TRACK
from rtctl.diagnose.measure import begin, compare, free_run
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator, resolution
from rtctl.diagnose.tacho import folded, noise, signed
from rtctl.plants.physics import TERMS

RATE, ROWS, NOISE = 50.0, 500, 0.01
CASE = {
    "plant": "axis", "sample_rate": RATE, "parameters": {"M": 1.0, "F_v": 2.0}, "controller": {"kind": "none"},
    "drive": {"newton_per_volt": 4.0, "limit_volt": 10.0}, "reaches": {"parameter_tolerance": 0.5},
}  # fmt: skip
BLIND = TERMS["sensor.rectified"].settings(node="sensor")
RINGS = TERMS["structure.resonance"].settings(node="carriage", f_Hz=1.7, mass=0.6, zeta=0.12)


def steps(seed: int = 0) -> np.ndarray:
    """Volts (n,) that go either way every tenth of a second."""
    return np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], ROWS // 5), 5)


def recorded(*terms, case=None, u=None, noisy=NOISE, **parameters):
    """What an axis with these terms and parameters shows of its speed."""
    case, u, zero = read_case({**CASE, **(case or {})}, "."), steps() if u is None else u, np.zeros(ROWS)
    blank = Record("axis", case, np.arange(ROWS) / RATE, 1 / RATE, zero, zero, u[:, None], {"speed": zero}, {})
    model = owner_model(read_case(CASE, ".")).change(**parameters).add(*terms)
    shown = Simulator(blank).run(model, OPEN)[:, 0] + noisy * np.random.default_rng(1).standard_normal(ROWS)
    return blank._replace(y={"speed": shown}), model


def test_what_misleads_a_position_misleads_a_speed():
    true = recorded(noisy=0.0)[0].y["speed"]
    np.testing.assert_allclose(recorded(BLIND, noisy=0.0)[0].y["speed"], np.abs(true), atol=2e-3)
    off = TERMS["sensor.scale"].settings(node="sensor", relative=0.1)
    np.testing.assert_allclose(recorded(off, noisy=0.0)[0].y["speed"], 1.1 * true, rtol=1e-6)


@pytest.mark.parametrize("terms", [(), (BLIND,), (BLIND, RINGS)])
def test_the_true_model_keeps_to_the_track_and_a_wrong_one_is_kept_near(terms):
    record, model = recorded(*terms, noisy=0.0)
    sim = Simulator(record)
    assert np.abs(sim.run(model, TRACK)[:, 0] - sim.seen).max() < 1e-9
    heavy = model.change(M=1.3)
    off = [np.std(sim.run(heavy, mode)[50:, 0] - sim.seen[50:]) for mode in (TRACK, OPEN)]
    assert off[0] < 0.8 * off[1]


@pytest.mark.parametrize("terms", [(), (RINGS,), (BLIND, RINGS)])
def test_noise_is_what_no_regression_foretells(terms):
    """Within a factor of two and a half of a machine that is not even linear."""
    record, _ = recorded(*terms)
    found = noise(record.y["speed"], record.u)
    assert 0.8 * NOISE < found < 2.5 * NOISE
    assert resolution(record) == found


def test_few_rows_tell_no_noise():
    assert noise(np.ones(20), np.ones((20, 1))) == 0.0
    assert noise(np.zeros(200), np.zeros((200, 1))) == 0.0


def test_a_folded_speed_gets_its_sign_from_the_command():
    true = recorded()[0].y["speed"]
    record, _ = recorded(BLIND)
    shown, u = record.y["speed"], record.u[:, 0]
    assert folded(shown, u) and not folded(true, u) and not folded(shown, np.abs(u))
    fast = np.abs(true) > 0.1
    assert np.mean(np.sign(signed(shown, u)[fast]) == np.sign(true[fast])) > 0.97
    np.testing.assert_array_equal(signed(true, u), true)


@pytest.mark.parametrize("blind", [False, True])
def test_a_free_run_begins_with_the_speed_that_the_first_rows_have_either_way(blind):
    whole, model = recorded(*((BLIND,) if blind else ()), noisy=0.0)
    true = recorded(noisy=0.0)[0].y["speed"]
    k = int(np.flatnonzero((true < -0.5) & (np.arange(ROWS) > 50))[0])
    cut = whole._replace(
        t=whole.t[k:], ref=whole.ref[k:], w=whole.w[k:], u=whole.u[k:], y={"speed": whole.y["speed"][k:]}
    )
    sim = Simulator(cut)
    start = begin(sim, model)
    assert start[1] == pytest.approx(true[k], abs=1e-3)
    np.testing.assert_allclose(free_run(sim, model, start)[:, 0], cut.y["speed"], atol=2e-3)
    assert compare(cut, model, OPEN, skip=20).as_json()["unit"] == {"speed": "m/s"}


def counted(rate, command):
    """A position that shows the sum of `rate` under a command."""
    return SimpleNamespace(
        plant="axis", shows_speed=False, dt=1e-3, y={"x": np.cumsum(rate) * 1e-3}, u=command[:, None]
    )
