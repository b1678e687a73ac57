"""An owner who writes down no friction at all has left out what every axis has, before anything else is asked for.

Dry and viscous friction are then one first step: each alone is a poor model, beside which a weak supply or a limit of
the drive looks better than the other one does, and the laws that only alter friction (sticking, give, another for each
direction) have nothing to alter.

Bristles are dry friction too, and where they bend through most of the travel, as in a spring with hysteresis, plain dry
friction is as poor a model of them as none, and bristles without a limit do nothing: the two come together.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from rtctl.diagnose.fit import Fit, fit, parallel
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import polish
from rtctl.diagnose.space import Hypothesis, Space
from rtctl.plants.physics import only

PLAIN = (only("friction", "dry"), only("friction", "viscous"))
OWN = ("F_c", "F_v")  # the owner's names of them
DRY, BRISTLES = PLAIN[0], only("replaces", "dry")
SOFT = (1.0, 30.0, 300.0)  # times the least that bristles are tried with, up to a third of the travel


def bare(base: Fit) -> bool:
    """Whether it is an axis of whose friction the owner says nothing."""
    return base.model.kind == "axis" and not any(base.model.base.get(name, 0.0) for name in OWN)


def rubbing(problem: Problem, base: Fit, candidates: Sequence[Hypothesis]) -> Fit | None:
    """The base with both plain frictions; None where the owner has one of them, or the machine is no axis."""
    if not bare(base):
        return None
    first = {h.term: h for h in reversed(candidates) if h.term in PLAIN}
    if len(first) < len(PLAIN):
        return None
    space = base.space.add(*(first[name] for name in PLAIN))
    x = begun(space, base, dict.fromkeys(PLAIN, 1.0))  # both brake: from there it is one trough
    return polish(problem, fit(problem, space, x, rounds=16))


def soft(problem: Problem, model: Fit, candidates: Sequence[Hypothesis]) -> list[Fit]:
    """The model with dry friction on bristles, from stiff and from soft ones; nothing where the owner has dry friction,
    or the machine is no axis."""
    there = {h.term for h in model.space.hypotheses}
    kinds = {h.term: h for h in (*reversed(candidates), *model.space.hypotheses) if h.term in (DRY, BRISTLES)}
    known = model.model.kind != "axis" or model.model.base.get(OWN[0], 0.0) or BRISTLES in there
    if known or len(kinds) < 2:
        return []
    space = model.space.add(*(h for term, h in kinds.items() if term not in there))
    starts = [begun(space, model, {DRY: 1.0, BRISTLES: share}) for share in SOFT]
    return parallel([partial(fit, problem, space, x, rounds=16) for x in starts])


def begun(space: Space, model: Fit, sizes: dict[str, float]) -> np.ndarray:
    """A start of `space`, in which `model` stands as it is and what it has more has these `sizes` by term."""
    x = space.start()
    x[: len(model.x)] = model.x
    for i in range(len(model.space.hypotheses), len(space.hypotheses)):
        h = space.hypotheses[i]
        x[space.columns(i)[h.sizes]] = sizes[h.term]
    return x
