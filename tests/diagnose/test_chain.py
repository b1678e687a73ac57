"""The whole diagnosis on small recordings of an axis, made by the simulator itself and cut into counts."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

from rtctl.config.errors import NoAnswer
from rtctl.diagnose import chain
from rtctl.diagnose.case import read_case
from rtctl.diagnose.chain import (
    borne_out,
    diagnose_record,
    misread,
    slip_is_imagined,
    sound,
    stays,
    tells,
    without_reels,
)
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, as_json
from rtctl.diagnose.fit import fit
from rtctl.diagnose.kernel import CLOSED
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.record import Record, check
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import INVERSE, Coordinate, Hypothesis, Space
from rtctl.plants.physics import TERMS

STEP = 1e-6  # m, of the encoder
CASE = {
    "format": 1,
    "plant": "axis",
    "sample_rate": 1000.0,
    "parameters": {"M": 95.0, "F_v": 200.0, "F_c": 20.0},
    "sensors": {"x_resolution_m": STEP},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "delay_samples": 0.0,
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
    "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15},
}
SPRING = {"term": "load.spring", "node": "carriage", "k": 600.0}
COGGING = {"term": "ripple.cogging", "node": "carriage", "A": 0.2, "turn": 0.01}


def recording(*physics, seconds=10.0, true=None, shaken=0.0) -> Record:
    """What the axis with `physics` in it does on a sum of two slow sines; `true` parameters differ from the owner's.
    `shaken`: rms of random forces, N."""
    case, n = read_case(CASE, "."), round(1000 * seconds)
    t, zero = np.arange(n) * 1e-3, np.zeros(n)
    ref = 0.05 * (1 - np.cos(2 * np.pi * 0.4 * t)) + 0.01 * np.sin(2 * np.pi * 1.3 * t)
    empty = Record("axis", case, t, 1e-3, ref, zero, zero[:, None], {"x": zero}, {})
    model = owner_model(case).change(**(true or {}))
    model = model.add(*(TERMS[entry["term"]].settings(**entry) for entry in physics))
    out, volts, _ = Simulator(empty).everything(model, CLOSED)
    off, answered = thrown(n, shaken)
    volts = volts + answered[:, None]
    x = np.round((out[:, 0] + off) / STEP) * STEP
    # the law saw the reading before it was cut: the recorded command is the input
    case = case._replace(controller_known=False)
    return check({"t": t, "ref": ref, "w": zero, "u": volts[:, 0], "x": x}, case)


def thrown(n: int, force: float) -> tuple[np.ndarray, np.ndarray]:
    """How far white forces of `force` N rms throw the axis off (n,) under its law, and the volts with which that
    answers: to both the machine is a mass with a damper, so that they add to any motion that keeps its direction."""
    per_volt, stiff, damp = CASE["drive"]["newton_per_volt"], 160.0 * 243.0, 243.0
    loop = signal.cont2discrete(([1.0], [95.0, 200.0 + per_volt * damp, per_volt * stiff]), 1e-3)
    off = signal.lfilter(loop[0].ravel(), loop[1], force * np.random.default_rng(5).standard_normal(n))
    return off, -stiff * off - damp * np.gradient(off, 1e-3)


@pytest.fixture(scope="module")
def spring():
    said = []
    return diagnose_record(recording(SPRING), progress=said.append), said


def test_what_is_missing_is_named_where_it_is_and_as_large_as_it_is(spring):
    d, _ = spring
    assert d.verdict in (NAMED, AMBIGUOUS)
    effect = next(e for e in d.effects if e.name == "load.spring")
    assert effect.node == "carriage"
    assert effect.parameters["k"].value == pytest.approx(600.0, rel=0.05)
    assert effect.parameters["k"].low <= effect.parameters["k"].value <= effect.parameters["k"].high


def test_the_new_model_predicts_what_it_was_not_fitted_on(spring):
    d, _ = spring
    assert d.heldout_after < 0.2 * d.heldout_before
    assert d.fit_rows[1] < len(d.record.t)
    assert any(term.term == "load.spring" for term in d.after.terms)
    assert d.before.terms == ()


def test_its_stages_are_told_in_order(spring):
    _, said = spring
    assert said[0] == "preflight"
    assert said.index("fitting the nominal parameters") == 1
    assert any(text.startswith("screening ") for text in said)
    assert said[-1].startswith("predicting ")


def test_its_form_on_disk(spring):
    made = as_json(spring[0])
    assert made["verdict"] in ("named", "ambiguous")
    assert {"name", "node", "confidence", "parameters", "look_alikes"} <= made["effects"][0].keys()
    assert 0.0 < made["effects"][0]["confidence"] < 1.0
    assert made["fit"].keys() == {"heldout_nrmse_before", "heldout_nrmse_after", "noise_floor"}
    assert all(name.count(":") == 1 for name in made["cannot_test"])


def test_wrong_values_are_not_missing_physics():
    d = diagnose_record(recording(true={"M": 88.0, "F_v": 215.0}))
    assert d.verdict == NOTHING
    assert d.effects == ()
    assert d.after == d.before
    assert d.parameters["M"].value == pytest.approx(88.0, rel=0.02)
    assert d.hides  # how large each effect could be and still hide
    assert not (d.random_forces or d.faint)


def test_random_forces_are_said_and_nothing_else():
    d = diagnose_record(recording(shaken=15.0))
    assert d.verdict == NOTHING
    assert d.random_forces and as_json(d)["random_forces"]
    assert d.heldout_before > 3.0 * d.noise_floor


def test_what_drowns_in_random_forces_is_named_by_errors_that_are_made_white():
    d = diagnose_record(recording(COGGING, shaken=1.0))
    assert (d.verdict, [e.name for e in d.effects]) == (NAMED, ["ripple.cogging"])
    assert d.faint and as_json(d)["faint"]
    size = d.effects[0].parameters["A"]
    assert size.low < 0.2 < size.high
    assert d.effects[0].parameters["turn"].value == pytest.approx(0.01, rel=0.01)


@pytest.mark.parametrize(("made", "other"), [("timing.delay", "drive.lag"), ("drive.lag", "timing.delay")])
def test_a_delay_and_a_lag_of_as_much_are_told_apart(made, other):
    late = {"timing.delay": {"node": "loop", "extra": 1.5e-3}, "drive.lag": {"node": "drive", "tau": 1.5e-3}}[made]
    d = diagnose_record(recording({"term": made, **late}, shaken=1.0))
    assert (d.verdict, [e.name for e in d.effects]) == (NAMED, [made])
    assert other in [r.name for r in d.effects[0].look_alikes]


def test_a_second_recording_is_predicted_whole(spring):
    other = recording(SPRING, seconds=4.0)
    d = diagnose_record(recording(SPRING, seconds=5.0), other)
    assert d.heldout_after < d.heldout_before


def test_no_verdict_from_too_little():
    with pytest.raises(NoAnswer, match="supports no verdict"):
        recording(SPRING, seconds=0.4)


@pytest.mark.parametrize(
    ("reel", "explained", "expected"), [(9.0, False, True), (9.0, True, False), (2.0, False, False)]
)
def test_reels_that_no_model_follows_are_misread(monkeypatch, reel, explained, expected):
    errors = {"capstan_counts": np.full(50, 3.0), "reel1_counts": np.ones(9), "reel2_counts": np.full(9, reel)}
    problem = SimpleNamespace(channels=[0], by_sensor=lambda r: errors)
    found = SimpleNamespace(problem=problem, base=None, best=SimpleNamespace(r=None))
    monkeypatch.setattr(chain.decide, "enough", lambda problem, before, after: explained)
    assert misread(found) == expected


@pytest.mark.parametrize(("share", "expected"), [(0.6, False), (None, True)])
def test_a_slip_that_does_no_more_than_its_correction_is_imagined(contact, share, expected):
    machine = contact.plain.change(M=1.02 * contact.plain.base["M"])
    limit = 1e3 if share is None else contact.carried(share)  # nothing slips below a kNm
    problem = Problem(contact.seen(machine if share is None else contact.slipping(machine, limit)))
    plain = Space(contact.plain, ("M",), lambda name: 0.15)
    slip = Hypothesis("transmission.slip", "wheel", (Coordinate("F_max", INVERSE, limit, 0.0),))
    found = fit(problem, plain.add(slip), np.array([np.log(1.02), 1.0]), rounds=0)
    assert slip_is_imagined(problem, found) == expected
    assert sound(problem, found) != expected
    assert sound(problem, fit(problem, plain, rounds=0))


class Told:
    """A model of some terms, as far as it is asked for them."""

    def __init__(self, *names):
        self.hypotheses = tuple(SimpleNamespace(term=name) for name in names)

    def without(self, index):
        return Told(*(h.term for i, h in enumerate(self.hypotheses) if i != index))


@pytest.mark.parametrize(
    ("drive", "push", "expected"),
    [
        ((0.5, 0.9), (0.55, 0.9), ["load.spring", "drive.offset"]),  # a cost of 0.4, and what is left without each
        ((0.5, 0.9), (0.41, 0.9), ["drive.offset"]),
    ],
)
def test_what_shows_only_because_of_how_the_model_is_led_is_left_out(monkeypatch, drive, push, expected):
    def problem(behind):
        return SimpleNamespace(sim=SimpleNamespace(behind=behind), pushed_behind=lambda: problem(True))

    def fake(problem, space, x, rounds):
        without = dict(zip(("load.spring", "drive.offset"), push if problem.sim.behind else drive, strict=True))
        gone = set(without) - {h.term for h in space.hypotheses}
        return SimpleNamespace(space=space, x=None, cost=max([0.4, *(without[name] for name in gone)]))

    def fewer(found, index):
        left = found.best.space.without(index)
        return SimpleNamespace(problem=found.problem, best=fake(found.problem, left, None, 10))

    monkeypatch.setattr(chain, "fit", fake)
    monkeypatch.setattr(chain, "drop", lambda start, index: None)
    monkeypatch.setattr(chain, "with_fewer", fewer)
    both = Told("load.spring", "drive.offset")
    found = SimpleNamespace(problem=problem(False), best=fake(problem(False), both, None, 10))
    assert [h.term for h in borne_out(found).best.space.hypotheses] == expected
    led = SimpleNamespace(problem=problem(True), best=found.best)
    assert borne_out(led) is led


@pytest.mark.parametrize(
    ("quiet", "names", "again", "expected"),
    [
        (True, (), "followed", "of the capstan"),  # nothing is missing there
        (False, (), "followed", "first"),
        (False, ("friction.coulomb",), "followed", "through the capstan"),
        (False, ("friction.coulomb",), "misread", "first"),
    ],
)
def test_reels_that_no_model_follows_are_read_through_what_the_capstan_shows(
    monkeypatch, quiet, names, again, expected
):
    class Capstan:
        def __init__(self, sim):
            assert sim == "sim"

        def seen_by(self, model):
            return f"reels by {model}"

    def find(sim, problem, progress, base):
        if isinstance(problem, Capstan):
            best = SimpleNamespace(space=SimpleNamespace(hypotheses=names), model="capstan's")
            return SimpleNamespace(told="of the capstan", base=base, best=best)
        assert problem == "reels by capstan's"
        return SimpleNamespace(told="through the capstan")

    monkeypatch.setattr(chain, "Problem", Capstan)
    monkeypatch.setattr(chain, "base_fit", lambda sim, problem, x=None: SimpleNamespace(x=x))
    monkeypatch.setattr(chain, "find", find)
    monkeypatch.setattr(chain, "misread", lambda found: again == "misread")
    monkeypatch.setattr(chain.decide, "quiet", lambda problem, before, after: quiet)
    assert without_reels("sim", SimpleNamespace(told="first"), lambda text: None).told == expected


@pytest.mark.parametrize(
    ("left", "names", "hiss", "expected"),
    [
        (3.0, ("load.spring",), False, True),
        (2.0, ("load.spring",), True, False),
        (2.0, (), False, False),
        (2.0, (), True, True),
    ],
)
def test_a_quicker_correction_is_asked_where_something_shows_or_where_all_was_wandering(left, names, hiss, expected):
    found = SimpleNamespace(best=SimpleNamespace(space=SimpleNamespace(hypotheses=names)))
    quick = SimpleNamespace(floor=1.0, hiss=lambda r: hiss)
    assert tells(found, quick, SimpleNamespace(rms=left, r=None)) == expected


@pytest.mark.parametrize(
    ("told", "names", "again", "merit", "hiss", "expected"),
    [
        (True, ("ripple.cogging",), False, 1.0, False, True),
        (True, ("ripple.cogging",), False, 3.0, False, False),
        (True, ("ripple.cogging",), True, 1.0, False, False),
        (False, ("ripple.cogging",), False, 1.0, True, False),
        (False, (), False, 1.0, False, False),
        (False, (), False, 1.0, True, True),
        (False, (), True, 1.0, True, False),
    ],
)
def test_a_quicker_correction_has_the_say_unless_it_shows_less(monkeypatch, told, names, again, merit, hiss, expected):
    """What may be told stays, and so does that there is nothing but random forces."""

    def found(enough, merit):
        best = SimpleNamespace(space=SimpleNamespace(hypotheses=names), x=None, merit=merit, enough=enough)
        return SimpleNamespace(problem=SimpleNamespace(hiss=lambda r: hiss), base=SimpleNamespace(r=None), best=best)

    monkeypatch.setattr(chain.decide, "enough", lambda problem, base, best: best.enough)
    monkeypatch.setattr(chain, "fit", lambda problem, space, x, rounds: SimpleNamespace(merit=merit))
    assert stays(found(told, 0.5), found(again, 2.0)) == expected
