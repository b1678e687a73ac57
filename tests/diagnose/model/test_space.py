"""Coordinates x and models: bounds, cosine-sine pairs, limits, zero sizes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_records import driven

from rtctl.diagnose.calibration import BEYOND
from rtctl.diagnose.model.by_symbol import Model
from rtctl.diagnose.model.space import (
    COSINE,
    INVERSE,
    PLACE,
    REST,
    SHAPE,
    SINE,
    SIZE,
    WIDE,
    Coordinate,
    Hypothesis,
    Space,
)
from rtctl.plants.physics import TERMS

OWNER = Model("axis", {"M": 95.0, "K": 35.0, "F_v": 200.0, "F_c": 20.0, "k": 0.0})
STRIBECK = Hypothesis(
    "friction.stribeck",
    "carriage",
    (Coordinate("F_s", SIZE, 10.0, offset=20.0), Coordinate("v_s", SHAPE, 0.05, -3.0, 3.0)),
    {"form": "tustin"},
)
COGGING = Hypothesis(
    "ripple.cogging",
    "carriage",
    (Coordinate("A|phi", COSINE, 4.0), Coordinate("A|phi", SINE, 4.0), Coordinate("per_turn", SHAPE, 6.0, -0.2, 0.2)),
)
BUMP = Hypothesis(
    "load.bump", "carriage", (Coordinate("F", SIZE, 5.0), Coordinate("at", PLACE, 0.01, -1.5, 1.5, offset=0.05)),
    {"width": 0.002},
)  # fmt: skip
LIMIT = Hypothesis("drive.saturation", "drive", (Coordinate("limit", INVERSE, 7.0, 0.0),))


def space(*hypotheses, tolerance=0.15):
    return Space(OWNER, ("M", "F_v", "F_c"), lambda name: tolerance, hypotheses)


numbers = st.floats(-3.0, 3.0, allow_subnormal=False)


@settings(deadline=None)
@given(st.lists(numbers, min_size=3, max_size=3))
def test_plant_coordinates_are_log_ratios_to_the_nominal_values(x):
    model = space().model(np.array(x))
    for name, value in zip(("M", "F_v", "F_c"), x, strict=True):
        assert np.log(model.base[name] / OWNER.base[name]) == pytest.approx(value, abs=1e-12)
    assert model.base["K"] == 35.0
    assert model.base["k"] == 0.0


@settings(deadline=None)
@given(numbers, numbers)
def test_amplitude_and_phase_are_the_polar_form_of_a_coordinate_pair(a, b):
    values = COGGING.values([a, b, 0.0])
    assert values["A"] * np.exp(1j * values["phi"]) == pytest.approx(4.0 * (a + 1j * b), abs=1e-12)
    assert values["per_turn"] == 6.0
    assert set(values) == {"A", "phi", "per_turn"}


@settings(deadline=None)
@given(numbers, numbers)
def test_size_has_an_offset_and_shape_keeps_its_sign(size, shape):
    values = STRIBECK.values([size, shape])
    assert values["F_s"] == pytest.approx(20.0 + 10.0 * size)
    assert np.log(values["v_s"] / 0.05) == pytest.approx(shape, abs=1e-12)


def test_place_coordinate_is_relative_to_its_start():
    assert BUMP.values([0.0, 0.5])["at"] == pytest.approx(0.055)


def test_limit_is_infinite_at_zero_and_equals_its_scale_at_one():
    assert LIMIT.values([0.0])["limit"] > 1e6
    assert LIMIT.values([1.0])["limit"] == 7.0
    assert LIMIT.values([-0.5])["limit"] > 1e6  # below its bound: infinite, not negative


def test_size_coordinates_of_each_hypothesis():
    assert [h.sizes for h in (STRIBECK, COGGING, BUMP, LIMIT)] == [[0], [0, 1], [0], [0]]


def test_settings_contain_choices_and_defaults_of_the_term():
    made = STRIBECK.settings([1.0, 0.0])
    assert (made.term, made.node, made.F_s, made.form) == ("friction.stribeck", "carriage", 30.0, "tustin")
    bump = BUMP.settings([1.0, 0.0])
    assert (bump.width, bump.form, bump.every_turn) == (0.002, "drag", False)
    assert bump == TERMS["load.bump"].settings(**bump.model_dump())  # valid as user input


def test_x_is_split_into_the_parts_of_the_hypotheses():
    both = space(STRIBECK, COGGING)
    x = np.arange(8.0)
    assert [list(p) for p in both.parts(x)] == [[3.0, 4.0], [5.0, 6.0, 7.0]]
    assert len(both.start()) == len(both.prior()) == len(both.steps()) == 8
    model = both.model(0.1 * x)
    assert [t.term for t in model.terms] == ["friction.stribeck", "ripple.cogging"]


def test_adding_and_removing_a_hypothesis_restores_the_space():
    one = space(STRIBECK)
    two = one.add(COGGING, LIMIT)
    assert two.without(1).without(1) == one
    assert len(two.hypotheses) == 3
    assert one.hypotheses == (STRIBECK,)


def test_known_terms_remain_in_the_model():
    offset = TERMS["drive.offset"].settings(node="drive", offset=0.1)
    held = Space(OWNER.add(offset), ("M",), lambda name: 0.1, (LIMIT,))
    assert [t.term for t in held.model(held.start()).terms] == ["drive.offset", "drive.saturation"]


@pytest.mark.parametrize("tolerance", [0.02, 0.15, 0.5])
def test_parameter_bounds_are_a_multiple_of_the_tolerance(tolerance):
    s = space(STRIBECK, tolerance=tolerance)
    low, high = s.bounds()
    ends = [s.model(x).base["M"] for x in (np.where(np.isfinite(low), low, 0), np.where(np.isfinite(high), high, 0))]
    np.testing.assert_allclose(ends, [95.0 * (1 - BEYOND * tolerance), 95.0 * (1 + BEYOND * tolerance)])
    assert (low[3:] == [-np.inf, -3.0]).all()
    assert (high[3:] == [np.inf, 3.0]).all()


def test_infinite_tolerance_gives_wide_bounds_and_no_prior():
    s = space(STRIBECK, tolerance=np.inf)
    low, high = s.bounds()
    assert (low[:3] == -WIDE).all()
    assert (high[:3] == WIDE).all()
    assert not s.prior().any()


def test_prior_weights_follow_the_tolerance_and_effects_have_none():
    weights = [space(STRIBECK, tolerance=t).prior() for t in (0.1, 0.2)]
    np.testing.assert_allclose(weights[0][:3], 4.0 * weights[1][:3])
    assert not weights[0][3:].any()


@pytest.mark.parametrize("hypothesis", [STRIBECK, COGGING, BUMP, LIMIT], ids=lambda h: h.term)
def test_effect_at_its_start_does_not_change_the_simulation(plain, hypothesis):
    model = plain.model.change(F_c=20.0) if hypothesis is STRIBECK else plain.model  # no friction above the base level
    s = Space(model, (), lambda name: 0.1, (hypothesis,))
    runs = [
        driven(plain.record, m)["x"]
        for m in (s.owner, s.model(s.start()), s.model(s.start() + with_sizes_of_two(hypothesis)))
    ]
    np.testing.assert_allclose(runs[1], runs[0], rtol=0, atol=1e-12)
    assert np.abs(runs[2] - runs[0]).max() > 1e-6


def with_sizes_of_two(hypothesis):
    """Coordinates with every size at two units."""
    x = np.zeros(len(hypothesis.coordinates))
    x[hypothesis.sizes] = 2.0
    return x


@pytest.mark.parametrize("soft", [0.5, -0.2, 1e-9, 0.0])
def test_spring_coordinates_give_a_linear_force_for_any_stiffness(soft):
    """The force is linear in both sizes, also for zero stiffness."""
    spring = Hypothesis(
        "load.spring", "carriage", (Coordinate("k", SIZE, 40.0), Coordinate("x0", REST, 6.0, offset=0.3))
    )
    values = spring.values([soft, 0.5])
    assert -values["k"] * (0.3 - values["x0"]) == pytest.approx(3.0)
    assert -values["k"] * (0.8 - values["x0"]) == pytest.approx(3.0 - 40.0 * soft * 0.5, abs=1e-4)
    assert spring.sizes == [0, 1]
