"""Errors of the laws of the description: of its friction, its known effects, and effects too small for a name.

Dry friction breaks away gradually, and depends on speed. Under a right description the residual of these errors is no
missing effect: they are integrated out of every model, as the errors of the effects on trial are (slack.py).

Source: Brynjarsdottir & O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse
Problems 30 (2014).
"""

from collections.abc import Sequence

import numpy as np

from rtctl.diagnose.calibration import UNSEEN
from rtctl.diagnose.likelihood.descent import Point
from rtctl.diagnose.likelihood.fits import Fitted, evaluated
from rtctl.diagnose.likelihood.inexact import effect
from rtctl.diagnose.likelihood.slack import Inexact
from rtctl.diagnose.model.space import SIZE, Coordinate, Hypothesis
from rtctl.diagnose.search.hypotheses import hypotheses

FRICTION = (".dry", ".viscous")  # ends of the paths of a body's friction in a description
LESS = 0.1  # share of the friction of the description: step of the difference quotient


def inexact(base: Fitted) -> Fitted:
    """Fitted description whose likelihood includes the errors of its own laws."""
    model, like = base.model, base.like
    known = [effect(like, model.without_known(i), base.e, str(model.terms[i].node)) for i in range(model.known())]
    laws = np.concatenate([rubbing(base), *known], axis=2)
    own = Inexact(laws, unseen(base, hypotheses(like.parts[0].sim, model)))
    return evaluated(like.described(own), base.space, Point(base.x, base.e, base.J))


def rubbing(base: Fitted) -> np.ndarray:
    """Errors (blocks, sensors, columns) of the friction of the description, of standard deviation one.

    The difference quotient removes a small share: a model without friction may move where the machine stood at rest.
    """
    model = base.model
    less = {path: value * (1.0 - LESS * path.endswith(FRICTION)) for path, value in model.base.items()}
    return effect(base.like, model._replace(base=less), base.e, str(base.like.parts[0].sim.body)) / LESS


def unseen(base: Fitted, candidates: Sequence[Hypothesis]) -> np.ndarray:
    """Errors (blocks, sensors, columns), of standard deviation one, by effects below the resolution of a sensor.

    Each candidate with a least size gives one column for each share in UNSEEN.
    """
    fine: dict[str, Hypothesis] = {}
    for h in candidates:  # the first form of a term is its plainest
        if any(has_least(c) for c in h.coordinates):
            fine.setdefault(h.name, h)
    changes = []
    for h in fine.values():
        for share in UNSEEN:
            x = [share * c.low if has_least(c) else c.start for c in h.coordinates]
            e = base.like.raw(base.model.add(h.settings(x)))
            if not base.like.ran_away(e) and np.any(e - base.e):
                changes.append(e - base.e)
    return np.stack(changes, axis=2) if changes else np.zeros((*base.e.shape, 0))


def has_least(c: Coordinate) -> bool:
    """Whether a coordinate is a size whose lower bound is the resolution of a sensor."""
    return c.kind == SIZE and c.low > 0.0
