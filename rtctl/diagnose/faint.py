"""Effects that drown in what random forces leave, looked for in errors that are made white.

Asked where the fitted base is near the noise and nothing else was found. There all of a term's evidence is in what the
errors just before do not foretell, and so each hypothesis is screened and fitted anew. Of a linear drive nothing is
asked: where it sticks and lets go the cost has troughs, and what a fit leaves of a wrong one is no noise, though it
looks like it (seen: dry friction of 40 standard deviations on a machine that lacked nothing; of 53 reel units and axes
none came to both limits).

Source: Rao (1948) for the score test; Liang & Zeger, Biometrika 73 (1986), for a size that is as sure as blocks of
errors bear it out.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose import decide, plausible
from rtctl.diagnose.fit import Fit, fit, parallel
from rtctl.diagnose.name import roughly, shortlist, well
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.screen import screen
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.stretches import in_blocks
from rtctl.diagnose.white import White

PLANTS = ("ivu", "axis")
RATIO, SURE = 60.0, 9.0  # of machines that lacked nothing the luckiest had 46 and 8.1, none more than 60 and 7
SHARE = 0.05  # of the cost: what takes off less is no matter
LIKELY, FULL = 6, 4  # hypotheses that are fitted roughly, and in full
SHORTEST = 50  # errors in a block, however quickly a correction forgets


class Faint(NamedTuple):
    """What was found in white errors."""

    problem: Problem  # in which names are weighed so
    fits: tuple[Fit, ...]  # to the errors themselves, the likeliest first


class Evidence(NamedTuple):
    """Of a term, in white errors."""

    ratio: float  # of likelihoods, twice its logarithm
    sure: float  # its size over the size's standard deviation


def faint(
    problem: Problem, base: Fit, candidates: Sequence[Hypothesis], progress: Callable[[str], None] = lambda text: None
) -> Faint | None:
    """The term that shows in white errors beside `base`, and what else may be in its place; None if there is none."""
    if problem.sim.record.plant not in PLANTS or problem.louder > 1.0 or not decide.quiet(problem, base, base):
        return None
    progress("looking beneath the random forces")
    white = White(problem, base.r)
    ground = fit(white, base.space, base.x, rounds=6, J=white.through(base.J))
    scores = screen(white, ground, list(candidates))
    rough = parallel([partial(roughly, white, ground, score) for score in shortlist(scores, LIKELY)])
    likely = sorted(rough, key=lambda f: f.cost)[:FULL]
    full = parallel([partial(well, white, f, f.x, ground.cost) for f in likely])
    there = [f for f in full if stands_out(white, ground, f)]
    if not there:
        return None
    weights = decide.probabilities(full)
    full = [full[i] for i in np.argsort(-weights, kind="stable")]
    if not any(full[0] is f for f in there):
        return None
    told = parallel([partial(fit, problem, f.space, f.x, rounds=6) for f in full])
    if told[0].cost > (1.0 - SHARE) * base.cost or plausible.unlikely(told[0]):
        return None
    return Faint(problem.weighed_in(white), tuple(told))


def stands_out(white: White, ground: Fit, fitted: Fit) -> bool:
    """Whether the term that `fitted` has more is there, as far as white errors tell, and is what it wants to be."""
    found = evidence(white, ground, fitted)
    return found.ratio > RATIO and found.sure > SURE and not decide.at_end(ground, fitted)


def evidence(problem: Problem, before: Fit, after: Fit) -> Evidence:
    """What `after` does better than `before`, both fitted in white errors."""
    does = before.r - after.r
    power, agrees = (in_blocks(does * e, max(problem.block, SHORTEST)) for e in (does, after.r))
    sure = float(power.sum() / max(np.linalg.norm(agrees), 1e-300))
    return Evidence(2.0 * (before.cost - after.cost), sure)
