"""The judge's numbers, on fits made by hand."""

import numpy as np
import pytest
from by_hand import made, with_terms
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose.chances import by_accident, by_noise, p_value
from rtctl.diagnose.decide import complete, enough, explained, loud, probabilities, same_law, spent, worth
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.plausible import slight, unlikely
from rtctl.diagnose.space import SHAPE, SIZE, Coordinate, Hypothesis, Space
from rtctl.diagnose.stretches import loudness


class Floor:
    """As much of a Problem as the judge looks at."""

    def __init__(self, floor, hiss=False, parted=False):
        self.floor, self.hiss, self.block, self.louder = floor, lambda r: hiss, 20, 1.0
        self.parted = lambda r: parted
        self.loudness, self.measured, self.white = loudness, False, None


@pytest.mark.parametrize(
    ("left", "hiss", "parted", "expected"),
    [(9.0, False, False, True), (9.0, True, False, False), (3.0, False, False, False), (3.0, False, True, True)],
)
def test_something_is_missing_where_much_is_left_or_where_sensors_differ(left, hiss, parted, expected):
    base = made(np.full(50, left))
    assert loud(Floor(1.0, hiss, parted), base) == expected  # type: ignore[arg-type]


rms = st.floats(0.1, 100.0)


@settings(deadline=None)
@given(rms, rms, rms)
def test_what_is_explained_is_a_share(before, after, floor):
    share = explained(Floor(floor), made(np.full(50, before)), made(np.full(50, after)))  # type: ignore[arg-type]
    assert 0.0 <= share <= 1.0
    if after >= before:
        assert share == 0.0


@settings(deadline=None)
@given(st.floats(1.5, 100.0))
def test_down_to_the_floor_all_is_explained_and_with_nothing_gained_nothing(before):
    full, half = made(np.full(50, before)), made(np.full(50, np.sqrt(0.5 * (before**2 + 1.0))))
    assert explained(Floor(1.0), full, made(np.ones(50))) == pytest.approx(1.0)  # type: ignore[arg-type]
    assert explained(Floor(1.0), full, made(np.full(50, 0.7))) == pytest.approx(1.0)  # type: ignore[arg-type]
    assert explained(Floor(1.0), full, half) == pytest.approx(0.5, abs=1e-9)  # type: ignore[arg-type]
    assert explained(Floor(1.0), full, full) == 0.0  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("there", "left", "expected"), [(100.0, 16.0, True), (1000.0, 160.0, False), (1000.0, 40.0, True)]
)
def test_a_name_may_leave_no_more_than_it_could_miss_by_its_form(there, left, expected):
    here = np.where(np.arange(4000) < 2000, np.sqrt(2.0), 0.0)
    elsewhere = left * (np.sqrt(2.0) - here)
    before, after = made(there * here + elsewhere), made(elsewhere, 1)
    assert enough(Floor(1.0), before, after) == expected  # type: ignore[arg-type]


def test_a_term_is_worth_it_where_it_takes_a_material_share_off():
    noise, before = Floor(0.5), made(np.full(1000, 2.0))
    assert worth(noise, before, before, made(np.full(1000, 1.0), 1))  # type: ignore[arg-type]
    assert not worth(noise, before, before, made(np.full(1000, 1.99), 1))  # type: ignore[arg-type]
    assert not worth(noise, before, before, before)  # type: ignore[arg-type]
    assert not worth(noise, before, before, made(np.full(1000, 3.0), 1))  # type: ignore[arg-type]


def test_what_many_numbers_gain_is_less_worth_than_what_one_does():
    noise, before, r = Floor(0.5), made(np.full(1000, 2.0)), np.full(1000, 1.7)
    assert worth(noise, before, before, made(r, 1))  # type: ignore[arg-type]
    assert not worth(noise, before, before, made(r, 40))  # type: ignore[arg-type]


def test_below_the_noise_there_is_nothing_to_take():
    quiet = made(np.full(1000, 0.9))
    assert not worth(Floor(1.0), quiet, quiet, made(np.full(1000, 0.1), 1))  # type: ignore[arg-type]


@settings(deadline=None)
@given(st.floats(0.5, 4.0), st.floats(0.85, 4.0), st.floats(0.0, 300.0), st.integers(0, 2**32))
def test_beside_what_is_spent_no_term_is_worth_it(one, two, did, seed):
    """Whatever its errors are, as long as it follows no noise."""
    rng = np.random.default_rng(seed)
    shape = rng.standard_normal((2, 2000))
    left, better = shape / np.sqrt(np.mean(shape**2, axis=1, keepdims=True)) * [[one], [two]]
    base, before = made(left + did * (np.arange(2000) < 300)), made(left, 1)
    if spent(Floor(1.0), base, before):  # type: ignore[arg-type]
        assert not worth(Floor(1.0), base, before, made(better, 2))  # type: ignore[arg-type]


def test_what_is_spent():
    quiet, loud, base = made(np.full(1000, 0.9), 1), made(np.full(1000, 1.1), 1), made(np.full(1000, 20.0))
    assert spent(Floor(1.0), quiet, quiet)  # type: ignore[arg-type]
    assert not spent(Floor(1.0), loud, loud)  # type: ignore[arg-type]
    assert spent(Floor(1.0), base, loud)  # as much as the form of its law may miss  # type: ignore[arg-type]


def stretched(r, terms, mass):
    """A fit whose owner's mass is off by this share, of the tenth that it may be."""
    fitted = made(r, terms)
    space = fitted.space._replace(names=("M",))
    x = np.append(np.log1p(mass), fitted.x)
    return fitted._replace(space=space, x=x, J=np.zeros((len(fitted.r), len(x))))


def test_what_frees_an_owners_value_all_along_is_there_though_most_of_it_is_in_a_few_places():
    rng = np.random.default_rng(7)
    noise = rng.standard_normal(8000)
    small, big = 1.8 * noise, np.zeros(8000)
    big[700:740] = big[5100:5140] = 18.0
    base = stretched(2.0 * noise + big + 300.0 * (np.arange(8000) < 400), 0, 0.1)
    held, freed = stretched(2.0 * noise + big, 1, 0.1), stretched(small, 2, 0.03)
    assert explained(Floor(0.5), base, held) > 0.97  # type: ignore[arg-type]
    assert p_value(freed, held, 100) > 2e-3
    assert worth(Floor(0.5), base, held, freed)  # type: ignore[arg-type]
    assert not worth(Floor(0.5), base, held, stretched(small, 2, 0.1))  # type: ignore[arg-type]
    here_and_there = np.where(rng.random(8000) < 0.5, 1.1, 0.9)
    few = stretched(here_and_there * (2.0 * noise), 2, 0.03)  # better in the two places and nowhere else
    assert few.cost < 0.8 * held.cost
    assert not worth(Floor(0.5), base, held, few)  # type: ignore[arg-type]


def test_near_the_noise_a_term_must_take_more():
    before, after = made(np.full(1000, 1.1)), made(np.full(1000, 1.1 * np.sqrt(0.87)), 1)
    assert not worth(Floor(1.0), before, before, after)  # type: ignore[arg-type]
    assert worth(Floor(0.1), before, before, after)  # type: ignore[arg-type]


def test_what_the_form_of_a_law_misses_asks_for_no_second_term():
    """A term takes 300 off a stretch and leaves 6 there: its law is not the machine's own to the last per cent."""
    r = np.full(4000, 1.0)
    loud, left, better = r.copy(), r.copy(), r.copy()
    loud[:200], left[:200], better[:200] = 300.0, 6.0, 1.0
    base, one, two = made(loud), made(left, 1), made(better, 2)
    assert complete(Floor(0.8), base, one) and not complete(Floor(0.5), one, one)  # type: ignore[arg-type]
    assert not worth(Floor(0.8), base, one, two)  # type: ignore[arg-type]
    everywhere = made(np.where(np.arange(4000) < 200, 6.0, 0.5), 2)
    assert worth(Floor(0.4), base, one, everywhere)  # type: ignore[arg-type]


def test_a_second_term_may_show_at_a_few_places_only_if_noise_cannot():
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(8000)
    push = np.zeros(8000)
    for start in (700, 2900, 5100, 7300):  # of all the record four places
        push[start : start + 200] = 2.0
    base = noise + push + 20.0 * (np.arange(8000) < 400)  # what the first term has taken
    one, two = made(noise + push, 1), made(noise, 2)
    assert p_value(two, one, 200) > 1e-4  # by places alone it could be luck
    assert by_noise(one, two) < 1e-20
    assert worth(Floor(0.8), made(base), one, two)  # type: ignore[arg-type]
    lucky = made(noise + 0.02 * push, 1)
    assert by_noise(lucky, two) > 1e-4
    assert not worth(Floor(0.8), made(base), lucky, two)  # type: ignore[arg-type]


def test_beside_what_has_a_name_for_nearly_all_a_term_must_beat_chance():
    noise, rows = 4.0 * np.random.default_rng(4).standard_normal(8000), np.arange(8000)
    left = noise + 30.0 * (rows // 20 % 100 == 50)  # at four places
    base, little = made(left + 200.0 * (rows < 400)), made(left + 20.0 * (rows < 400))
    one, some, all_over = made(left, 1), made(noise, 2), made(0.8 * left, 2)
    assert not complete(Floor(1.0), base, one)  # type: ignore[arg-type]
    assert explained(Floor(1.0), base, one) > 0.97 > explained(Floor(1.0), little, one)  # type: ignore[arg-type]
    assert some.cost < all_over.cost
    assert p_value(some, one, 20) > 2e-3
    assert not worth(Floor(1.0), base, one, some)  # type: ignore[arg-type]
    assert worth(Floor(1.0), little, one, some)  # type: ignore[arg-type]
    assert worth(Floor(1.0), base, one, made(0.7 * left, 2))  # type: ignore[arg-type]


def test_a_fit_is_complete_near_the_floor():
    for rms, expected in ((0.5, True), (1.0, True), (2.0, False)):
        fitted = made(np.full(10, rms))
        assert complete(Floor(1.0), fitted, fitted) == expected  # type: ignore[arg-type]
    assert complete(Floor(1.0, hiss=True), made(np.full(10, 5.0)), made(np.full(10, 5.0)))  # type: ignore[arg-type]


@settings(deadline=None)
@given(st.lists(st.tuples(rms, st.integers(0, 5)), min_size=1, max_size=6))
def test_probabilities_add_up_to_one_and_go_by_cost(told):
    fits = [made(np.full(20, r), terms) for r, terms in told]
    p = probabilities(fits)
    assert p.sum() == pytest.approx(1.0)
    assert (p >= 0.0).all()
    for one, weight in zip(fits, p, strict=True):
        for two, other in zip(fits, p, strict=True):
            if one.cost <= two.cost and len(one.x) <= len(two.x):
                assert weight >= other * (1 - 1e-9)


def test_well_below_the_noise_models_are_equally_good():
    noise = np.random.default_rng(0).standard_normal(2000)
    fits = [made(level * noise, 1) for level in (0.6, 0.7, 1.0)]
    assert probabilities(fits)[0] > 0.99
    np.testing.assert_allclose(probabilities(fits, 0.9), [0.5, 0.5, 0.0], atol=1e-6)


def test_equals_share_and_the_one_with_more_numbers_is_less_likely():
    same = probabilities([made(np.ones(20), 1), made(np.ones(20), 1)])
    np.testing.assert_allclose(same, [0.5, 0.5])
    fewer = probabilities([made(np.ones(20), 1), made(np.ones(20), 4)])
    assert fewer[0] > fewer[1]


def test_of_two_equal_laws_the_one_with_the_usual_size_is_likelier():
    """An offset of 0.1 V or dry friction that differs by 0.9 from one direction to the other."""
    r = np.random.default_rng(0).standard_normal(2000)

    def fitted(term, node, name, value):
        h = Hypothesis(term, node, (Coordinate(name, SIZE, 1.0),))
        space = Space(Model("axis", {"M": 1.0}), (), lambda name: 0.1, (h,))
        return Fit(space, np.array([value]), r, np.zeros((len(r), 1)), 0.5 * float(r @ r))

    offset = fitted("drive.offset", "drive", "offset", 0.1)
    assert probabilities([offset, fitted("friction.asymmetry", "carriage", "a", 0.9)])[0] > 0.9
    assert probabilities([offset, fitted("friction.asymmetry", "carriage", "a", 0.2)])[0] == pytest.approx(0.5)


def test_a_law_that_looks_like_one_at_the_same_node_may_be_its_form():
    play, twist = ("transmission.backlash", "motor2"), ("structure.stiffening", "motor2")
    assert same_law(with_terms(play), with_terms(play, twist))
    assert not same_law(with_terms(play), with_terms(play, ("structure.stiffening", "motor1")))
    assert not same_law(with_terms(play), with_terms(play, ("drive.offset", "motor2")))
    bristles, play = ("friction.presliding", "carriage"), ("transmission.backlash", "sensor")
    assert same_law(with_terms(bristles, kind="axis"), with_terms(bristles, play, kind="axis"))  # which is one body
    assert not same_law(with_terms(bristles, kind="ldu"), with_terms(bristles, play, kind="ldu"))


def test_a_size_that_nobody_misses_is_not_worth_a_name_however_clearly_it_shows():
    dry = Hypothesis("friction.coulomb", "carriage", (Coordinate("F_C", SIZE, 2.0, slight=0.1),))
    before, after = made(np.full(200, 9.0)), made(np.full(200, 1.0))
    space = before.space.add(dry)
    for size, expected in ((0.09, True), (-0.09, True), (0.11, False), (-0.5, False)):
        found = after._replace(space=space, x=np.array([size]))
        assert slight(found) == unlikely(found) == expected
        assert worth(Floor(1.0), before, before, found) != expected  # type: ignore[arg-type]


def test_what_explains_little_of_a_little_needs_more_than_luck():
    rng = np.random.default_rng(3)
    base = 1.8 * rng.standard_normal(4000)
    half = made(0.7 * base, 1)
    noise = Floor(1.0)
    assert 1e-3 > p_value(half, made(base), 20)
    assert enough(noise, made(base), half)  # type: ignore[arg-type]
    weak = made(np.where(rng.random(4000) < 0.97, base, 0.9 * base), 1)
    assert not enough(noise, made(base), weak)  # type: ignore[arg-type]


def test_what_may_be_a_machine_that_is_not_quiet_needs_a_miracle_or_to_be_most_of_it():
    rows, white = np.arange(8000), np.random.default_rng(6).standard_normal(8040)
    wander = np.convolve(white, np.ones(41) / np.sqrt(41.0), "valid")[:8000]
    push = 6.0 * (rows // 50 % 32 == 5) * np.where(rows // 1600 % 2, 1.0, -1.0)  # at five places
    base, after = made(wander + push), made(wander, 1)
    assert p_value(after, base, 80) > 1e-5
    assert by_noise(base, after) > 1e-100
    assert 0.3 * base.cost < after.cost < 0.7 * base.cost
    assert not enough(Floor(1.0), base, after)  # type: ignore[arg-type]
    assert enough(Floor(1.0), base, made(0.5 * wander, 1))  # type: ignore[arg-type]
    assert enough(Floor(1.0), made(wander + 4.0 * push), after)  # type: ignore[arg-type]
    hiss = white[:8000]
    assert by_noise(made(hiss + push), made(hiss, 1)) < 1e-100  # no noise does so much at few places
    assert enough(Floor(1.0), made(hiss + push), made(hiss, 1))  # type: ignore[arg-type]


def test_what_leaves_much_is_not_enough_however_small_a_share_that_is():
    floor, before = Floor(1.0), made(np.full(200, 900.0))
    assert enough(floor, before, made(np.full(200, 15.0), 1))  # type: ignore[arg-type]
    assert not enough(floor, before, made(np.full(200, 90.0), 1))  # type: ignore[arg-type]


def test_a_further_term_at_the_end_of_its_times_is_none():
    tape = Hypothesis(
        "tape.viscoelastic", "tape2", (Coordinate("c", SIZE, 1.0), Coordinate("tau", SHAPE, 1.2, -4.0, 3.0))
    )
    before, beyond, within = (made(np.full(200, level)) for level in (9.0, 2.0, 2.0))
    before = before._replace(space=before.space.add(made([1.0], 1).space.hypotheses[0]), x=np.zeros(1))
    both = before.space.add(tape)
    beyond = beyond._replace(space=both, x=np.array([0.0, 1.0, 3.0]))
    within = within._replace(space=both, x=np.array([0.0, 1.0, 2.9]))
    owner = made(np.full(200, 9.0))
    assert worth(Floor(1.0), owner, before, within)  # type: ignore[arg-type]
    assert not worth(Floor(1.0), owner, before, beyond)  # type: ignore[arg-type]
    assert worth(Floor(1.0), owner, owner, beyond)  # type: ignore[arg-type]


def pushed(size):
    """Errors of before and after, of which the first are pushed in blocks of very different strength: few count."""
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(1200)
    bursts = np.exp(1.6 * rng.standard_normal(30)).repeat(2) * rng.choice([-1, 1], 60)
    return made(noise + size * bursts.repeat(20) / np.std(bursts)), made(noise, 1)


def test_where_the_noise_is_measured_a_first_term_may_be_borne_out_by_few_blocks():
    before, after = pushed(0.55)
    assert p_value(after, before, 20) > 1e-4 and by_accident(before, after, 20) < 1e-6
    floor = Floor(0.85)
    assert not worth(floor, before, before, after)  # type: ignore[arg-type]
    floor.measured = True
    assert worth(floor, before, before, after)  # type: ignore[arg-type]
    slight, _ = pushed(0.1)
    assert not worth(floor, slight, slight, after)  # type: ignore[arg-type]


def test_what_takes_much_off_by_no_accident_is_there_however_few_blocks_hold_most_of_it():
    before, after = pushed(0.8)
    floor = Floor(0.85)
    assert p_value(after, before, 20) > 1e-4
    assert worth(floor, before, before, after)  # type: ignore[arg-type]
    assert enough(floor, before, after)  # type: ignore[arg-type]
    burst = 4.0 * np.random.default_rng(8).standard_normal(1200)
    once = made(after.r + burst * (np.arange(1200) < 40))  # as much, in two blocks
    assert after.cost < 0.75 * once.cost
    assert not worth(floor, once, once, after)  # type: ignore[arg-type]
    assert not enough(Floor(0.85, hiss=True), once, after)  # type: ignore[arg-type]
