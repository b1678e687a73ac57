"""Intervals: that they hold the truth as often as they say, and that they are told in the right unit."""

import numpy as np
import pytest

from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.quantities import quantities
from rtctl.diagnose.space import COSINE, INVERSE, PLACE, SHAPE, SINE, SIZE, Coordinate, Hypothesis, Space
from rtctl.diagnose.uncertainty import (
    FORM,
    LITTLE,
    Z90,
    covariance,
    effect_intervals,
    parameter_intervals,
    plant_unit,
    with_form,
)

OWNER = Model("axis", {"M": 95.0, "K": 35.0, "F_v": 200.0, "F_c": 20.0, "k": 0.0})
SPRING = Hypothesis("load.spring", "carriage", (Coordinate("k", SIZE, 100.0),))
STRIBECK = Hypothesis(
    "friction.stribeck", "carriage", (Coordinate("F_s", SIZE, 10.0, offset=20.0), Coordinate("v_s", SHAPE, 0.05))
)
LIMIT = Hypothesis("drive.saturation", "drive", (Coordinate("limit", INVERSE, 7.0, 0.0),))
BUMP = Hypothesis(
    "load.bump", "carriage", (Coordinate("F", SIZE, 5.0), Coordinate("at", PLACE, 0.01, offset=0.3)), {"width": 2e-3}
)
COGGING = Hypothesis("ripple.cogging", "motor1", (Coordinate("A|phi", COSINE, 4.0), Coordinate("A|phi", SINE, 4.0)))
ROWS, BLOCK, RUNS = 3000, 100, 400


def space(*hypotheses, names=(), tolerance=np.inf, owner=OWNER):
    return Space(owner, names, lambda name: tolerance, hypotheses)


def linear(rng, space, J, x, memory):
    """The fit of a model that is linear in x, to errors that go together for `memory` rows."""
    kernel = np.exp(-np.arange(8 * memory) / memory)
    noise = np.convolve(rng.standard_normal(ROWS + 8 * memory), kernel / np.linalg.norm(kernel), "valid")[:ROWS]
    found = x + np.linalg.lstsq(J, noise, rcond=None)[0]
    r = J @ (found - x) - noise
    return Fit(space, found, r, J, 0.5 * float(r @ r))


def slow(rng, columns):
    """Columns of a Jacobian (rows, columns) that vary slowly, as simulations do."""
    t = np.linspace(0, 1, ROWS)
    return np.stack([np.sin(2 * np.pi * (k + 1.5) * t + rng.uniform(0, 6)) for k in range(columns)], axis=1)


def shares(memory):
    rng = np.random.default_rng(11)
    s, x = space(SPRING, STRIBECK), np.array([2.0, 1.0, 0.3])
    J = slow(rng, 3)
    held = np.zeros(3)
    for _ in range(RUNS):
        found = linear(rng, s, J, x, memory)
        half = Z90 * np.sqrt(np.diag(covariance(found, BLOCK)))
        held += np.abs(found.x - x) <= half
    return held / RUNS


@pytest.mark.parametrize("memory", [1, 8])
def test_intervals_hold_the_truth_nine_times_in_ten(memory):
    """White errors, and errors that go together: 30 blocks leave the intervals a little narrow."""
    assert shares(memory) == pytest.approx(0.90, abs=0.07)


def test_without_blocks_errors_that_go_together_make_them_far_too_narrow():
    rng = np.random.default_rng(11)
    s, J = space(SPRING), slow(rng, 1)
    found = linear(rng, s, J, np.ones(1), 8)
    one, many = (np.sqrt(covariance(found, b)[0, 0]) for b in (1, BLOCK))
    assert one < 0.5 * many


def test_a_parameter_that_nothing_shows_keeps_the_width_of_the_owners_word():
    rng = np.random.default_rng(3)
    s = space(names=("M", "F_v"), tolerance=0.15)
    J = np.stack([100 * slow(rng, 1)[:, 0], np.zeros(ROWS)], axis=1)
    found = Fit(s, np.zeros(2), rng.standard_normal(ROWS), J, 1.0)
    intervals = parameter_intervals(found, covariance(found, BLOCK))
    known, unknown = intervals["M"], intervals["F_v"]
    assert known.high - known.low < 0.01 * known.value
    assert unknown.high - unknown.low > 0.01 * unknown.value
    assert unknown.low >= 0.85 * 200.0 - 1e-9
    assert unknown.high <= 1.15 * 200.0 + 1e-9


def test_a_parameter_is_told_in_its_own_unit_with_ends_around_it():
    s = space(names=("M", "F_v"), tolerance=0.15)
    found = Fit(s, np.array([0.05, -0.02]), np.ones(10), np.zeros((10, 2)), 1.0)
    m = parameter_intervals(found, np.diag([1e-4, 1e-4]))["M"]
    assert m.value == pytest.approx(95.0 * np.exp(0.05))
    assert (m.low, m.high) == pytest.approx((m.value * np.exp(-0.01645), m.value * np.exp(0.01645)))
    assert m.unit == "kg"
    assert plant_unit(Model("axis", {}), "F_v") == "N*s/m"
    assert plant_unit(Model("axis", {}, units=quantities("rad", "A")), "F_v") == "Nm*s/rad"
    assert plant_unit(Model("axis", {}), "nothing") == ""


def effects(hypothesis, x, spread=0.1, before=()):
    s = space(*before, hypothesis)
    own = np.concatenate([h.start() for h in before] + [np.asarray(x, float)])
    found = Fit(s, own, np.ones(10), np.zeros((10, len(own))), 1.0)
    return effect_intervals(found, len(before), np.diag(np.full(len(own), spread**2)))


def test_a_size_spreads_either_way():
    k = effects(SPRING, [6.0])["k"]
    assert (k.value, k.low, k.high) == pytest.approx((600.0, 600.0 - 16.45, 600.0 + 16.45))
    assert k.unit == "N/m"


def test_a_shape_spreads_by_a_factor_and_a_place_by_a_way():
    told = effects(STRIBECK, [1.0, 0.0])
    assert told["F_s"].value == 30.0
    v = told["v_s"]
    assert v.low * v.high == pytest.approx(v.value**2)
    assert v.high / v.value == pytest.approx(np.exp(0.1645))
    at = effects(BUMP, [1.0, 0.5])["at"]
    assert (at.value, at.high - at.low) == pytest.approx((0.305, 2 * 1.645e-3))


def test_a_limit_has_its_near_end_first_and_may_be_anywhere_beyond():
    limit = effects(LIMIT, [1.0])["limit"]
    assert limit.low < limit.value < limit.high
    assert 7.0 / limit.low - 1.0 == pytest.approx(0.1645)
    assert effects(LIMIT, [0.1])["limit"].high > 1e6


def test_amplitude_and_phase_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(7)
    ivu = Model("ivu", {"M": 1.0})
    s = space(COGGING, owner=ivu)
    true = np.array([1.5, -2.0])
    A, phi = 4.0 * np.hypot(*true), np.arctan2(true[1], true[0])
    cov = np.array([[0.01, 0.004], [0.004, 0.02]])
    draws = rng.multivariate_normal(true, cov, RUNS)
    held = np.zeros(2)
    for x in draws:
        told = effect_intervals(Fit(s, x, np.ones(4), np.zeros((4, 2)), 1.0), 0, cov)
        held += [told["A"].low <= A <= told["A"].high, told["phi"].low <= phi <= told["phi"].high]
    np.testing.assert_allclose(held / RUNS, 0.9, atol=0.05)


def test_an_effect_behind_others_takes_its_own_columns():
    s = space(STRIBECK, SPRING)
    x = np.array([1.0, 0.0, 6.0])
    cov = np.diag([1.0, 1.0, 1e-4])
    k = effect_intervals(Fit(s, x, np.ones(4), np.zeros((4, 3)), 1.0), 1, cov)["k"]
    assert k.high - k.low == pytest.approx(2 * 1.645 * 1.0)


def test_the_sum_of_dry_friction_is_known_better_than_its_parts():
    """The owner's friction and the term do the same: only their sum shows."""
    rng = np.random.default_rng(4)
    rubs = Hypothesis("friction.coulomb", "carriage", (Coordinate("F_C", SIZE, 10.0),))
    s, x = space(rubs, names=("F_c",), tolerance=0.15), np.array([0.0, 0.6])
    one = slow(rng, 1)
    found = linear(rng, s, one @ np.array([[20.0, 10.0]]), x, 1)
    cov = covariance(found, BLOCK)
    out = effect_intervals(found, 0, cov)
    assert set(out) == {"F_C", "F_added"}
    added, total = out["F_added"], out["F_C"]
    assert total.value == pytest.approx(20.0 * np.exp(found.x[0]) + added.value)
    assert total.high - total.low < 0.2 * (added.high - added.low)


def test_values_that_are_all_off_by_one_factor_are_held_too():
    """A mass, a force and frictions that are right in proportion move as if nothing were wrong."""
    names, rng = ("M", "K", "F_v", "F_c"), np.random.default_rng(9)
    s = space(names=names, tolerance=0.15)
    J = 1e3 * slow(rng, 3) @ np.array([[1.0, -1, 0, 0], [0, 1, -1, 0], [0, 0, 1, -1]])  # no column tells the factor
    found = Fit(s, np.zeros(4), rng.standard_normal(ROWS), J, 1.0)
    intervals = parameter_intervals(found, covariance(found, BLOCK))
    for name in names:
        assert intervals[name].high == pytest.approx(OWNER.base[name] * np.exp(0.142), rel=0.01)


def test_of_a_term_the_form_of_its_law_stays_open():
    s = space(STRIBECK, LIMIT, BUMP, names=("M",), tolerance=0.15)
    x = np.array([0.02, 0.1, 2.0, 0.5, -0.7, 0.4])
    more = np.sqrt(np.diag(with_form(Fit(s, x, np.ones(4), np.zeros((4, 6)), 1.0), np.zeros((6, 6)))))
    assert more == pytest.approx([0.0, 0.1 * FORM[0], FORM[1], 0.5 * FORM[0], 0.7 * FORM[0], 0.0])
    turn = space(COGGING, owner=Model("ivu", {"M": 1.0}))
    wave = with_form(Fit(turn, np.array([3.0, 4.0]), np.ones(4), np.zeros((4, 2)), 1.0), np.zeros((2, 2)))
    assert wave == pytest.approx(np.diag([(5.0 * LITTLE[0]) ** 2] * 2))
