"""A closer look for a resonance, whose first look says nothing where it is strong and its frequency is not met.

A heavy part on a spring turns the whole response round about its frequency: a small mass at a frequency nearby, all
that the screening tries, explains nothing. So every frequency is tried with a mass that counts and with broad damping,
which lets a fit slide along.
"""

from collections.abc import Sequence

import numpy as np

from rtctl.diagnose.fit import Fit, Problem, fit, jacobian
from rtctl.diagnose.hypotheses import USUAL
from rtctl.diagnose.screen import Score
from rtctl.diagnose.space import Hypothesis

TERM = "structure.resonance"
STEP = 1.2  # between frequencies: with this damping a fit finds the way from half of it
HEAVY, BROAD = 0.25, 0.05  # of a tenth of the machine's inertia; damping ratio
NODES = {"ldu": 1, "ivu": 3, "axis": 1}  # that are looked at
ROUGH, FULL = 4, 2  # rounds of a rough fit, full fits


def resonances(problem: Problem, base: Fit, scores: Sequence[Score]) -> list[Fit]:
    """Full fits with a resonance on top of `base`, from the frequencies that do best in a rough one; at the usual nodes
    first, then in the order of the screening."""
    plant = problem.sim.record.plant
    nodes: dict[str, Hypothesis] = {}
    for score in sorted(scores, key=lambda s: (plant, s.hypothesis.node) not in USUAL):
        if score.hypothesis.term == TERM:
            nodes.setdefault(score.hypothesis.node, score.hypothesis)
    rough = [trial for h in list(nodes.values())[: NODES[plant]] for trial in _tried(problem, base, h)]
    best = sorted(rough, key=lambda f: f.merit)[:FULL]
    return [fit(problem, f.space, f.x, rounds=16, J=f.J) for f in best]


def _tried(problem: Problem, base: Fit, h: Hypothesis) -> list[Fit]:
    """Rough fits from each frequency, neighbours that do worse left out."""
    space, old = base.space.add(h), len(base.x)
    place = {c.name: i for i, c in enumerate(h.coordinates)}
    f, zeta = (h.coordinates[place[name]] for name in ("f_Hz", "zeta"))
    fits = []
    for at in np.arange(f.low, f.high, np.log(STEP)):
        x = h.start()
        x[place["mass"]], x[place["f_Hz"]], x[place["zeta"]] = HEAVY, at, np.log(BROAD / zeta.scale)
        start = np.concatenate([base.x, x])
        J = np.concatenate([base.J, jacobian(problem, space, start, range(old, len(start)))], axis=1)
        fits.append(fit(problem, space, start, rounds=ROUGH, J=J, rough=True))
    costs = [trial.cost for trial in fits]
    return [trial for i, trial in enumerate(fits) if trial.cost <= min(costs[max(i - 1, 0) : i + 2])]
