"""What becomes of a best model: a name, and no name for what only imitates."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Effect, Rival
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.jitter import Jitter
from rtctl.diagnose.model import Model
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis, Space
from rtctl.diagnose.verdict import (
    BY_SIZE,
    Alternative,
    Verdict,
    confidence,
    listed,
    of_jitter,
    only_testable,
    patched,
    proven,
    shared,
    with_known,
)


def fitted(**sizes):
    names = {"F_C": "friction.coulomb", "B": "friction.viscous", "mu": "friction.load", "offset": "drive.offset"}
    hypotheses = tuple(Hypothesis(names[k], "carriage", (Coordinate(k, SIZE, 1.0),)) for k in sizes)
    space = Space(Model("axis", {"M": 1.0}), (), lambda name: 0.1, hypotheses)
    return Fit(space, np.array(list(sizes.values())), np.ones(10), np.zeros((10, len(sizes))), 5.0)


@pytest.mark.parametrize(("sizes", "expected"), [
    ({"F_C": -1.0, "B": 5.0}, True), ({"F_C": 1.0, "B": 5.0}, False), ({"F_C": -1.0}, False),
    ({"F_C": -1.0, "mu": 0.3}, True), ({"F_C": -1.0, "offset": 0.1}, False),
])  # fmt: skip
def test_less_dry_and_more_of_another_friction_is_another_curve(sizes, expected):
    assert patched(fitted(**sizes)) == expected


@pytest.mark.parametrize(("sizes", "expected"), [((2.0, -1.0), True), ((2.0, 1.0), False), ((-2.0, -1.0), False)])
def test_less_dry_friction_at_one_body_and_more_at_another_is_no_machine_s(sizes, expected):
    of = (Hypothesis("friction.coulomb", node, (Coordinate("F_C", SIZE, 1.0),)) for node in ("motor2", "reel2"))
    space = Space(Model("ivu", {}), (), lambda name: 0.1, tuple(of))
    assert patched(Fit(space, np.array(sizes), np.ones(10), np.zeros((10, 2)), 5.0)) == expected


@pytest.mark.parametrize(("dry", "F_s", "expected"), [
    (-0.1, 1.0, False), (np.log(1.15), 1.3, False), (np.log(0.85), 1.3, True), (0.1, 1.05, True),
])  # fmt: skip
def test_friction_that_falls_to_the_least_that_the_owner_allows_or_rises_is_another_curve(dry, F_s, expected):
    falls = Hypothesis("friction.stribeck", "carriage", (Coordinate("F_s", SIZE, 1.0),))
    space = Space(Model("axis", {"F_c": 1.0}), ("F_c",), lambda name: 0.15, (falls,))
    assert patched(Fit(space, np.array([dry, F_s]), np.ones(10), np.zeros((10, 2)), 5.0)) == expected


def test_a_lag_shares_with_a_delay_that_it_is_not_surely_better_than_where_more_than_noise_is_left():
    noise = np.random.default_rng(2).normal(size=4000)
    problem = SimpleNamespace(floor=0.1, block=40, white=None)

    def place(name, r):
        space = fitted(offset=1.0).space._replace(
            hypotheses=(Hypothesis(name, "drive", (Coordinate("x", SIZE, 1.0),)),)
        )
        return Alternative(Fit(space, np.ones(1), r, np.zeros((len(r), 1)), 0.5 * float(r @ r)), 0)

    loud = np.where(np.arange(4000) < 120, 3.0, 1.0)  # three blocks of a hundred
    lag, delay, other = place("drive.lag", noise), place("timing.delay", 3.0 * noise), place("drive.lag", noise)
    few = place("timing.delay", loud * noise)
    assert shared(problem, [lag, delay])["drive.lag"] == pytest.approx(1.0)  # everywhere worse
    assert shared(problem, [lag, few])["drive.lag"] == pytest.approx(0.5)
    assert shared(problem, [few, lag])["timing.delay"] < 0.5  # a delay does not bend
    assert shared(problem, [lag, other]) == {"drive.lag": pytest.approx(1.0)}


def test_what_shows_elsewhere_stands_beside_a_verdict():
    jitter = of_jitter(Jitter(2e-4, 1e-5))
    scale = Effect("sensor.scale", "encoder", 0.95, {}, ())
    assert jitter.parameters["sigma"].low < 2e-4 < jitter.parameters["sigma"].high
    nothing, unnamed = Verdict(NOTHING, (), 0.0), Verdict(UNNAMED, (), 0.2)
    assert with_known(nothing, []) is nothing
    assert with_known(unnamed, [jitter]) is unnamed
    both = with_known(nothing, [jitter, scale])
    assert (both.verdict, [e.name for e in both.effects]) == (NAMED, ["timing.jitter", "sensor.scale"])
    doubt = Verdict(AMBIGUOUS, (Effect("drive.offset", "drive", 0.5, {}, ()),), 1.0)
    assert with_known(doubt, [jitter]).verdict == AMBIGUOUS
    assert [e.name for e in with_known(doubt, [jitter]).effects] == ["timing.jitter", "drive.offset"]


def test_it_is_not_told_twice():
    named = Verdict(NAMED, (Effect("sensor.scale", "encoder", 0.9, {}, ()),), 1.0)
    assert with_known(named, [Effect("sensor.scale", "encoder", 0.95, {}, ())]).effects == named.effects


def test_rivals_of_three_are_told_beside_them():
    own = [Effect(name, "drive", 0.9, {}, ()) for name in ("drive.lag", "drive.offset", "load.bump")]
    rivals = [Effect(name, "drive", 0.4, {}, (), "drive.offset:drive") for name in "abc"]
    assert listed(own, rivals) == (*own, *rivals[:2])
    assert listed(own[:2], rivals) == (*own[:2], *rivals[:2])
    assert listed(own[:1], rivals) == (own[0], *rivals[:2])
    assert listed(own[:1], []) == tuple(own[:1])


@pytest.mark.parametrize(("several", "closed", "expected"), [
    (False, 0.8, NAMED), (False, 0.5, UNNAMED), (True, 0.88, NAMED), (True, 0.8, UNNAMED), (True, -1.0, UNNAMED),
])  # fmt: skip
def test_a_name_must_predict_and_several_must_predict_better(several, closed, expected):
    named = Verdict(NAMED, (Effect("drive.offset", "drive", 0.98, {}, ()),), 1.0)
    told = proven(named, closed, several)
    assert told.verdict == expected
    assert all(0.88 < e.confidence < 0.96 for e in told.effects)
    assert proven(named, float("nan"), several).verdict == UNNAMED  # what no held-out row bears out has no name


def test_usual_sizes_alone_make_no_name_sure():
    even, worse = Rival("friction.asymmetry", "carriage", 0.5, 1.0), Rival("load.spring", "carriage", 1e-6, 1.2)
    assert confidence(0.96, (worse,)) == 0.96
    assert confidence(0.96, (worse, even)) == BY_SIZE
    assert confidence(0.4, (even,)) == 0.4


def test_where_the_model_without_it_is_right_to_the_noise_a_name_that_does_not_predict_leaves_nothing():
    named = Verdict(NAMED, (Effect("structure.resonance", "carriage", 0.98, {}, ()),), 0.8)
    assert proven(named, 0.2, False, NOTHING) == Verdict(NOTHING, (), 0.8)


@pytest.mark.parametrize(("sure", "closed", "expected"), [
    (0.8, 0.9, AMBIGUOUS), (0.8, 0.2, NOTHING), (0.5, 0.2, AMBIGUOUS), (0.8, float("nan"), NOTHING),
])  # fmt: skip
def test_a_name_that_is_likelier_by_far_must_predict_too(sure, closed, expected):
    rival = Effect("friction.asymmetry", "carriage", 0.1, {}, (), "drive.offset:drive")
    doubt = Verdict(AMBIGUOUS, (Effect("drive.offset", "drive", sure, {}, ()), rival), 1.0)
    assert proven(doubt, closed, False, NOTHING).verdict == expected


def test_what_the_record_cannot_test_is_never_named():
    cannot = {"drive.gain_asymmetry:drive"}
    tilt = Effect("drive.gain_asymmetry", "drive", 0.98, {}, ())
    rival = Effect("friction.viscous", "carriage", 0.1, {}, (), instead_of="drive.gain_asymmetry:drive")
    other = Effect("friction.coulomb", "carriage", 0.9, {}, ())
    assert only_testable(Verdict(NAMED, (tilt,), 0.9), cannot) == Verdict(UNNAMED, (), 0.9)
    assert only_testable(Verdict(NAMED, (other, tilt), 0.9), cannot).verdict == UNNAMED
    assert only_testable(Verdict(AMBIGUOUS, (tilt,), 0.9), cannot).verdict == UNNAMED
    told = only_testable(Verdict(AMBIGUOUS, (other, tilt, rival), 0.9), cannot)
    assert told.verdict == AMBIGUOUS and [e.confidence for e in told.effects] == [0.9, 0.5, 0.1]
    for verdict in (Verdict(NAMED, (other,), 0.9), Verdict(AMBIGUOUS, (other, tilt._replace(instead_of="x:y")), 0.9)):
        assert only_testable(verdict, cannot) is verdict
