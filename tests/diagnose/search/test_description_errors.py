import numpy as np
import pytest
from graph_cases import BELT, PENDULUM, case_of, command, record

from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.space import SIZE, Coordinate, Hypothesis
from rtctl.diagnose.search.description_errors import inexact, rubbing, unseen
from rtctl.diagnose.search.hypotheses import hypotheses

COUNT = 5e-6  # m, resolution of the scale


def fitted(machine, amplitude, terms=(), **more):
    """Base fit to a recording of a machine with extra `terms`."""
    like, space = together([record(case_of(machine, **more), command(amplitude), terms)])
    return refit(like, space)


def test_presliding_below_the_sensor_resolution_is_an_expected_error():
    base = fitted(BELT, 0.6, [{"term": "friction.presliding", "node": "carriage", "z_s": COUNT}])
    found = inexact(base)
    assert found.loss < base.loss - 20.0
    np.testing.assert_array_equal(found.x, base.x)


def test_only_effects_with_a_lower_bound_may_be_present_unseen():
    base = fitted(BELT, 0.6)
    assert unseen(base, []).shape[2] == 0
    offset = Hypothesis("drive.offset", "amplifier", (Coordinate("offset", SIZE, 0.03),))
    assert unseen(base, [offset]).shape[2] == 0
    candidates = hypotheses(base.like.parts[0].sim, base.model)
    assert {h.term for h in candidates if any(c.kind == SIZE and c.low > 0.0 for c in h.coordinates)}
    assert unseen(base, candidates).shape[2] > 0


def test_description_error_covers_a_wrong_viscous_friction():
    base = fitted(PENDULUM, 4.0)
    wrong = base.like.raw(base.model._replace(base={**base.model.base, "bodies.rod.viscous": 2.2e-3})) - base.e
    found = rubbing(base).reshape(len(base.e), -1)
    left = wrong[:, 0] - found @ np.linalg.lstsq(found, wrong[:, 0], rcond=None)[0]
    assert left @ left < 0.05 * (wrong[:, 0] @ wrong[:, 0])


def test_machine_without_friction_has_no_friction_error():
    bodies = {"rod": {key: value for key, value in PENDULUM["bodies"]["rod"].items() if key not in ("dry", "viscous")}}
    assert rubbing(fitted({**PENDULUM, "bodies": bodies}, 0.2)).shape[2] == 0


@pytest.mark.parametrize("known", [[], [{"term": "load.spring", "node": "rod", "k": 0.3}]])
def test_known_effects_have_a_law_error(known):
    base = inexact(fitted(PENDULUM, 4.0, known, physics=known))
    assert base.like.own.laws.shape[2] == (1 + len(known)) * rubbing(base).shape[2]
