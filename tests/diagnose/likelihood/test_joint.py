from functools import cache

import numpy as np
import pytest
from described_machines import ROD, ROTOR, case_of, moved, record, rotor, rounded, torque

from rtctl.config.errors import UserError
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.answer.config import to_config
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together

ONE_WAY = {"friction.coulomb", "drive.offset"}


@cache
def both():
    return diagnose_record(rotor(1, 0), rotor(-1, 1))


def test_one_direction_does_not_separate_friction_from_an_offset():
    d = diagnose_record(rotor(1, 0))
    assert d.verdict == AMBIGUOUS
    assert {e.name for e in d.effects} == ONE_WAY


def test_two_directions_together_separate_friction_from_an_offset():
    d = both()
    assert d.verdict == NAMED
    assert [(e.name, e.node) for e in d.effects] == [("friction.coulomb", "rotor")]
    assert d.effects[0].parameters["F_C"].value == pytest.approx(0.03, rel=0.02)
    assert d.as_json()["recordings"] == ["left", "right"]


def test_report_names_both_recordings():
    from rtctl.diagnose.answer.report import html

    assert "2 recordings of one machine: left and right" in html(both())


def test_joint_loss_is_the_sum_and_joint_residual_is_stacked():
    like = both().found.like.slackened(None)
    model = both().decided.best.model
    e = like.raw(model)
    parts = [part.raw(model) for part in like.parts]
    np.testing.assert_array_equal(e, np.concatenate(parts))
    assert like.loss(e) == pytest.approx(sum(p.loss(own) for p, own in zip(like.parts, parts, strict=True)))
    own = like.told(e)
    slow = sum(len(one.of(part)) for p, part in own.cut(e) for one in p.slow)
    assert len(own.white(e)) == own.size + slow
    np.testing.assert_allclose(own.white(e[:, :, None])[:, 0], own.white(e))
    early, late = like.split(0.25)
    assert len(early.raw(model)) + len(late.raw(model)) == pytest.approx(len(e), abs=2)


def test_law_errors_are_shared_by_all_recordings():
    like = both().found.like
    model = both().decided.best.model
    e = like.raw(model)
    error = np.random.default_rng(2).standard_normal((*e.shape, 1)) * 3.0 * e.std()
    loose = like.told(e).slackened(error)
    wrong = e + 2.0 * error[..., 0]
    assert np.abs(loose.left(wrong) - e).max() < 0.5 * np.abs(wrong - e).max()
    assert loose.told(wrong).loss(wrong) < like.told(wrong).loss(wrong)


@cache
def loads():
    """Joint fit of a pendulum with two loads; each recording has its own mass parameter."""

    def one(mass, believed, seed):
        u = 20.0 * torque(1, seed, 200.0, 4.0) * np.where(np.arange(800) % 100 < 50, 1.0, -1.0)
        x = moved(u, 200.0, 5e-3, lambda x, v: -2e-3 * v - mass * 9.80665 * 0.2 * np.sin(x))
        rod = {"inertia": 5e-3, "viscous": 2e-3, "gravity": {"mass": believed, "arm": 0.2}}
        machine = {"bodies": {"rod": rod}, "drives": {"motor": {**ROTOR["drives"]["motor"], "body": "rod"}},
                   "sensors": ROD["sensors"]}  # fmt: skip
        tolerance = {"default": 0.05, "bodies.rod.gravity.mass": 0.2, "bodies.rod.gravity.arm": 0.0}
        case = case_of(machine, 200.0, tolerance=tolerance, per_recording=["bodies.rod.gravity.mass"])
        return record(case, f"load-{believed:g}", tau=u, x=rounded(x, 1e-5))

    like, space = together([one(0.55, 0.5, 0), one(1.1, 1.0, 1)])
    return refit(like, space)


def test_per_recording_parameter_is_fitted_for_each_recording():
    f = loads()
    base = f.model.base
    assert base["bodies.rod.gravity.mass@load-0.5"] == pytest.approx(0.55, rel=0.01)
    assert base["bodies.rod.gravity.mass@load-1"] == pytest.approx(1.1, rel=0.01)
    assert "bodies.rod.gravity.mass" not in f.space.names
    assert f.space.names.count("bodies.rod.inertia") == 1


def test_config_has_the_parameters_of_its_recording():
    f = loads()
    first = f.like.sim.record
    machine = to_config(f.model, first)["machine"]
    mass = f.model.base[f"bodies.rod.gravity.mass@{first.name}"]
    assert float(str(machine["bodies"]["rod"]["gravity"]["mass"]).split()[0]) == pytest.approx(mass, rel=1e-5)


def test_undeclared_parameter_difference_is_refused():
    other = {"bodies": {"rotor": {"inertia": 2e-3, "viscous": 5e-4}}}
    u = torque(1, 0)
    case = case_of({**ROTOR, **other}, 500.0)
    second = record(case, "other", tau=u, counts=np.floor(1592.0 * moved(u, 500.0, 1e-3, lambda x, v: 0.0)))
    with pytest.raises(UserError, match=r"bodies.rotor.inertia is .*per_recording: \[bodies.rotor.inertia\]"):
        together([rotor(1, 0), second])
