"""An owner who writes down no friction at all has left out what every axis has, before anything else is asked for.

Dry and viscous friction are then one first step: each alone is a poor model, beside which a weak supply or a limit of
the drive looks better than the other one does, and the laws that only alter friction (sticking, give, another for each
direction) have nothing to alter.
"""

from collections.abc import Sequence

from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import polish
from rtctl.diagnose.space import Hypothesis

PLAIN = ("friction.coulomb", "friction.viscous")
OWN = ("F_c", "F_v")  # the owner's names of them


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
    x = space.start()
    x[: space.nb] = base.x
    for i, h in enumerate(space.hypotheses):  # both brake: from there it is one trough
        x[space.columns(i)[h.sizes]] = 1.0
    return polish(problem, fit(problem, space, x, rounds=16))
