"""What could stand in the place of a term that was found: the most likely others, and those that look like it."""

from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from rtctl.diagnose.fit import Fit, parallel
from rtctl.diagnose.name import roughly, shortlist, well
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import dropped
from rtctl.diagnose.screen import Score, screen
from rtctl.diagnose.space import Hypothesis


def rivals(
    problem: Problem, found: Fit, index: int, candidates: Sequence[Hypothesis], alike: Collection[str], most: int = 3
) -> list[Fit]:
    """Full fits in which term `index` is replaced by each of the most likely others, and by those that look `alike`."""
    rest = dropped(problem, found, index, 4)
    taken = {h.name for h in found.space.hypotheses}
    scores = screen(problem, rest, [h for h in candidates if h.name not in taken])
    rough = parallel([partial(roughly, problem, rest, score) for score in shortlist(scores, 8)])
    rough = sorted(rough, key=lambda f: f.merit)[:most]
    best = parallel([partial(well, problem, f, f.x, found.cost) for f in rough])
    seen = {f.space.hypotheses[-1].term for f in best}
    return sorted([*best, *look_alikes(problem, rest, scores, set(alike) - seen, found.cost)], key=lambda f: f.merit)


def look_alikes(problem: Problem, rest: Fit, scores: Sequence[Score], terms: Collection[str], cost: float) -> list[Fit]:
    """Full fits of these terms on top of `rest`, each at the node and start that does best at first sight."""
    first: dict[str, Score] = {}
    for score in scores:
        if score.hypothesis.term in terms and np.isfinite(score.gain):
            first.setdefault(score.hypothesis.term, score)
    rough = parallel([partial(roughly, problem, rest, score) for score in first.values()])
    return parallel([partial(well, problem, f, f.x, cost) for f in rough])
