from functools import cache

import numpy as np
from graph_cases import BELT, case_of, command, record

from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.linear import Linear
from rtctl.diagnose.search.extend import screened
from rtctl.plants.physics import TERMS

SLIP = {"term": "transmission.slip", "node": "belt", "F_max": 6.0}
SLIPS = "transmission.slip:belt"


@cache
def looked():
    """Base fit of a slipping belt, and its screening."""
    like, space = together([record(case_of(BELT), command(0.6), [SLIP])])
    base = refit(like, space)
    return base, screened(base)


def test_screening_difference_uses_the_step_size_of_the_effect():
    base, _ = looked()
    about = Linear(base)
    slip = next(s.hypothesis for s in looked()[1].scores if s.hypothesis.name == SLIPS)
    assert TERMS[slip.term].slips and about.coarse
    far = base.space.add(slip).model(np.append(base.x, 1e-6))  # limit above every force
    assert np.abs(base.like.raw(far, True) - about.start_of(slip)).max() == 0.0
    assert np.abs(base.like.raw(far, True) - about.start).max() > 0.0


def test_every_start_of_a_limit_changes_the_simulation():
    base, screen = looked()
    score = next(s for s in screen.scores if s.hypothesis.name == SLIPS)
    model = base.space.add(score.hypothesis).model
    none = base.like.raw(model(np.append(base.x, 0.0)))
    starts = screen.starts(score, 4)
    assert starts
    for x in starts:
        assert np.abs(base.like.raw(model(np.append(base.x, x[-1]))) - none).max() > base.like.least.max()


def test_belt_slip_is_the_best_single_effect():
    base, screen = looked()
    score = next(s for s in screen.scores if s.hypothesis.name == SLIPS)
    fits = [
        refit(base.like, base.space.add(score.hypothesis), x, base.J, screen.floor) for x in screen.starts(score, 2)
    ]
    best = max(fits, key=lambda f: f.log_evidence)
    assert best.log_evidence > base.log_evidence + 50.0
    np.testing.assert_allclose(best.space.hypotheses[0].settings(best.space.parts(best.x)[0]).F_max, 6.0, rtol=0.1)
