"""Looks for what the table has no name for, where names that it resembles have been found.

The names of the table are not all that a machine can do: drag by the square of speed looks like viscous friction with
some sticking. A name that gives way to such a law is not to be told.
"""

from collections.abc import Callable

from rtctl.diagnose import chances, decide
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import dropped, polish
from rtctl.diagnose.rivals import look_alikes
from rtctl.diagnose.screen import screen
from rtctl.plants.physics import TERMS

SURELY = 0.02  # chance of explaining as well, below which a name gives way to one law in its place
AS_GOOD = 1.02  # times the merit of several names: one law that does as well is likelier


def nameless(problem: Problem, base: Fit, best: Fit, progress: Callable[[str], None] = lambda text: None) -> Fit | None:
    """The model in which a law without a name takes the place of names that it does better than; None if there is none.

    In the place of one name it has to be ahead by more than chance, in the place of several, or alone in the place of
    all that `best` has beyond `base`, it has to do as well.
    """
    for term, told in TERMS.items():
        out = [i for i, h in enumerate(best.space.hypotheses) if h.term in told.imitated]
        nodes = {best.space.hypotheses[i].node for i in out}
        if not out:
            continue
        progress(f"{term} in the place of {' and '.join(best.space.hypotheses[i].term for i in out)}")
        rest = best
        for i in reversed(out):
            rest = dropped(problem, rest, i, 4)
        candidates = hypotheses(problem.sim.record, rest.model.base, only=(term,))
        there = [h for h in candidates if h.node in nodes] or candidates
        trials = look_alikes(problem, rest, screen(problem, rest, there), {term}, best.cost)
        if len(out) < len(best.space.hypotheses):
            trials += look_alikes(problem, base, screen(problem, base, there), {term}, best.cost)
        for fitted in trials:
            trial = polish(problem, fitted) if fitted.cost < 2 * best.cost else fitted
            surely = chances.p_value(trial, best, problem.block) < SURELY
            several = len(trial.space.hypotheses) < len(best.space.hypotheses)
            if (several and trial.merit < AS_GOOD * best.merit) or (surely and decide.better(best, trial)):
                return trial
    return None
