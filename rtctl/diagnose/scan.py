"""A closer look for what a first look says nothing of: a resonance that is strong and whose frequency is not met, a
tape that goes slack, and a narrow bump.

A heavy part on a spring turns the whole response round about its frequency: a small mass at a frequency nearby, all
that the screening tries, explains nothing. So every frequency is tried with a mass that counts and with broad damping,
which lets a fit slide along.

When a tape goes slack hangs on small differences between pull and friction: with the owner's values it does at other
moments, or never, and no slope leads from there to where it did. So values all over their tolerance are tried, and
beside another effect sizes of that up to a few times what it seems to be without the slack.

A bump is met or not met: a step off its place, or with another shape, a few rounds say nothing of what it comes to. So
the likeliest places are fitted in full in each of its shapes.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from rtctl.diagnose.fit import Fit, fit, jacobian, parallel
from rtctl.diagnose.hypotheses import USUAL
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.screen import Score, screen
from rtctl.diagnose.space import SIZE, Hypothesis
from rtctl.plants.physics import only

TERM = only("closer", "frequencies")
STEP = 1.2  # between frequencies: with this damping a fit finds the way from half of it
HEAVY, BROAD = 0.25, 0.05  # of a tenth of the machine's inertia; damping ratio
FASTEST = 0.2  # of the rate of the record: above it a part on a spring only shows as more inertia
ROUGH, FULL = 4, 2  # rounds of a rough fit, full fits
SLACK, ELSEWHERE, DEEP = only("closer", "tolerance"), 32, 3  # values tried all over their tolerance, and full fits
LARGER = 3.0  # times the size of an effect beside it
BUMP, PLACES = only("closer", "places"), 2  # places that are tried of each shape


def resonances(problem: Problem, base: Fit, scores: Sequence[Score]) -> list[Fit]:
    """Full fits with a resonance on top of `base`, from the frequencies that do best in a rough one: at every node of
    the reel unit, whose reels shake beside their motors, else at the usual one."""
    plant = problem.sim.record.plant
    nodes: dict[str, Hypothesis] = {}
    for score in scores:
        h = score.hypothesis
        if h.term == TERM and (plant == "ivu" or (plant, h.node) in USUAL):
            nodes.setdefault(h.node, h)
    rough = [trial for h in nodes.values() for trial in _tried(problem, base, h)]
    best = sorted(rough, key=lambda f: f.merit)[:FULL]
    return [fit(problem, f.space, f.x, rounds=16, J=f.J) for f in best]


def _tried(problem: Problem, base: Fit, h: Hypothesis) -> list[Fit]:
    """Rough fits from each frequency, neighbours that do worse left out."""
    space, old = base.space.add(h), len(base.x)
    place = {c.name: i for i, c in enumerate(h.coordinates)}
    f, zeta = (h.coordinates[place[name]] for name in ("f_Hz", "zeta"))
    fits = []
    fastest = np.log(FASTEST / problem.sim.record.dt / f.scale)
    for at in np.arange(f.low, min(f.high, fastest), np.log(STEP)):
        x = h.start()
        x[place["mass"]], x[place["f_Hz"]], x[place["zeta"]] = HEAVY, at, np.log(BROAD / zeta.scale)
        start = np.concatenate([base.x, x])
        J = np.concatenate([base.J, jacobian(problem, space, start, range(old, len(start)))], axis=1)
        fits.append(fit(problem, space, start, rounds=ROUGH, J=J, rough=True))
    costs = [trial.cost for trial in fits]
    return [trial for i, trial in enumerate(fits) if trial.cost <= min(costs[max(i - 1, 0) : i + 2])]


def slack(problem: Problem, base: Fit, scores: Sequence[Score]) -> list[Fit]:
    """Full fits with a tape that goes slack on top of `base`, from the plant parameters at which it does best."""
    if any(h.term == SLACK for h in base.space.hypotheses):
        return []
    kinds = {(s.hypothesis.node, *s.hypothesis.fixed.items()): s.hypothesis for s in scores}
    starts: list[Fit] = []
    for h in (h for h in kinds.values() if h.term == SLACK):
        space = base.space.add(h)
        xs = _all_over(base, h)
        errors = parallel([partial(problem.residual, space.model(x), True) for x in xs])
        starts += [Fit(space, x, r, np.empty((0, 0)), 0.5 * float(r @ r)) for x, r in zip(xs, errors, strict=True)]
    return [fit(problem, f.space, f.x, rounds=12) for f in sorted(starts, key=lambda f: f.cost)[:DEEP]]


def _all_over(base: Fit, h: Hypothesis) -> list[np.ndarray]:
    """Starts of `base` with `h`: the plant's parameters all over their tolerance, the sizes of what is there already
    from nothing to several times what they were."""
    plant, old = base.space._replace(hypotheses=()), base.x[base.space.nb :]
    xs = plant.spread(ELSEWHERE)
    shares = np.random.default_rng(0).uniform(0.0, LARGER, ELSEWHERE)
    sizes = np.array([c.kind == SIZE for own in base.space.hypotheses for c in own.coordinates], bool)
    beside = (np.where(sizes, share * old, old) for share in shares)
    return [np.concatenate([x, own, h.start()]) for x, own in zip(xs, beside, strict=True)]


def bumps(problem: Problem, model: Fit, proposed: Sequence[Hypothesis]) -> list[Fit]:
    """Full fits with a bump on top of `model`, in each of its shapes at the places that do best at first sight, of
    those that are `proposed` where the record is seen through that model."""
    plant, there = problem.sim.record.plant, {h.name for h in model.space.hypotheses}
    own = [h for h in proposed if h.term == BUMP and (plant, h.node) in USUAL and h.name not in there]
    count: dict[tuple[str, str], int] = {}
    starts: list[Score] = []
    for score in screen(problem, model, own):
        kind = score.hypothesis.node, str(score.hypothesis.fixed)
        count[kind] = count.get(kind, 0) + 1
        if count[kind] <= PLACES and score.gain > 0.0:
            starts.append(score)
    return parallel([partial(_met, problem, model, score) for score in starts])


def _met(problem: Problem, base: Fit, score: Score) -> Fit:
    """A full fit from where a first look has moved the bump to, the other parameters as they were."""
    space, old = base.space.add(score.hypothesis), len(base.x)
    start = np.concatenate([base.x, np.clip(score.x, *space.bounds())[old:]])
    return fit(problem, space, start, rounds=16)
