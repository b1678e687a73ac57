"""Judges what the search found: is it there, is it enough, and is it ahead of everything that looks like it?

A term earns its place when it takes a material share off the error, beyond what the luckiest of all hypotheses takes
off a record with nothing in it. It earns its name when the model with it explains what there was to explain, down to
the noise, when no bound holds it, and when it beats each rival by more than chance (see `chances`).
"""

import numpy as np
from scipy.stats import wilcoxon

from rtctl.diagnose.anylaw import freed, static
from rtctl.diagnose.chances import FEW, ahead, blocks, by_accident, by_noise, chance, p_value
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.plausible import slight, unusual
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.space import SHAPE, Hypothesis
from rtctl.diagnose.stretches import memory, rms
from rtctl.plants.physics import TERMS

LOUD = 4.5  # times the noise floor: below it what no hypothesis explains may be a machine that is not quiet
MATERIAL = 0.03  # share of the cost that a term must take off, beside its toll
NEARLY = 0.1  # the same where the model is already near the noise
BESIDE = 0.5  # the same where more is left than noise, which the form of a law may account for
QUIET = 0.85  # of the noise floor, below which models are equally good
MOST = 0.3  # of the cost: a term that leaves less is more than the form of another, and nothing that chance does
LUCK = 1e-4  # chance that a term does so well there by luck
RELEASED, FREE = 2e-3, 0.2  # chance and share where a term frees plant parameters from the ends of their tolerance
SELDOM = 1e-8  # chance that a further term does by accident what it does, wherever that is
MEASURED = 1e-6  # the same of a first term, where the floor is the noise of this very record
PLAIN = 0.75  # of the cost: of 71 machines in which nothing was missing none came to that and to SELDOM besides
NEVER = 1e-6  # chance of a term that no luck brings, whatever the number of its numbers
BEYOND = 0.75  # of the cost, once the laws beside a term may have any form
UNLIKELY = 1e-5  # chance of that, and of a name that explains less than most of what random forces may have done
NOWHERE = 1e-100  # chance of the same by noise at a few places: at rest, where friction creeps, 1e-72 was seen
CLEAR = 0.15  # share of the cost that it must take off
COMPLETE = 1.75  # times the noise floor of a quiet machine: what is left may well be noise
FORM = 0.04  # of what a term does: what the form of its law may miss
HALF = 0.5  # of the excess explained, and not by luck: something is there; less may be what any number takes off
MOSTLY = 0.75  # share of the excess that a name must explain besides
ENOUGH = 0.97  # share of the excess that a name must explain where the floor is not reached
LEFT = 20.0  # times the floor, or part of what was there, that it may leave: any law takes a share of what is loud


def worth(problem: Problem, base: Fit, before: Fit, after: Fit) -> bool:
    """Whether a further term took enough off.

    Below the floor there is nothing to take, and where what is left may be noise a term must take more: a lucky one may
    follow that for a while. Less is enough of what no form of the laws beside it could do.
    """
    if slight(after) or (before.space.hypotheses and at_end(before, after)):
        return False
    return earns(problem, base, before, after) or no_form(problem, before, after)


def earns(problem: Problem, base: Fit, before: Fit, after: Fit) -> bool:
    """As `worth`, where what the laws miss by their form is forgiven them as a share of what they do."""
    alike = same_law(before, after)
    much = after.cost < MOST * before.cost and rms(before.r) > problem.floor and problem.louder == 1.0
    if much and not alike and by_noise(before, after) < NEVER:
        return True
    weights = discount(problem, base, before)
    if rms(weights * before.r) < problem.floor:
        return False
    if problem.louder == 1.0 and not alike and releases(before, after) and nearly_everywhere(problem, before, after):
        return True
    share = MATERIAL
    if complete(problem, base, before):
        if problem.louder > 1.0:
            return False  # of a machine that is known to be louder nobody knows what is noise
        block = blocks(problem, after)
        luck = p_value(after, before, block)
        if releases(before, after) and luck < RELEASED:
            return True
        noise = rms(before.r) < COMPLETE * problem.floor and not alike
        clear = after.cost < (1.0 - CLEAR) * before.cost
        some = after.cost < (1.0 - NEARLY) * before.cost
        seldom = SELDOM if before.space.hypotheses else MEASURED * problem.measured
        if noise and some and by_accident(before, after, block) < seldom:
            return True
        if not alike and sure(problem, before, after):
            return True
        if luck > LUCK:
            return False
        if noise and clear and luck < NEVER:
            return True
        share = NEARLY if noise else BESIDE  # the pattern that a law's form leaves is followed by some other law
    elif (
        before.space.hypotheses
        and explained(problem, base, before) > ENOUGH  # nearly all has a name: chance may follow the rest
        and p_value(after, before, blocks(problem, after)) > RELEASED
    ):
        return False
    return merit(after, weights) < (1.0 - share) * merit(before, weights)


def releases(before: Fit, after: Fit) -> bool:
    """Whether the owner's values need not be stretched any more to the ends of their tolerance."""
    return bool(before.bound()) and not after.bound() and after.cost < (1.0 - FREE) * before.cost


def nearly_everywhere(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether a further term does better in nearly all of a record: most of that may be in a few blocks, which says
    little of their sum. Source: Wilcoxon, Biometrics Bulletin 1 (1945)."""
    if not before.space.hypotheses:
        return False
    gains = ahead(after.r, before.r, blocks(problem, after))
    return len(gains) >= FEW and float(wilcoxon(gains, alternative="greater").pvalue) < NEVER


def no_form(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether what a further term takes off is more than any function in the place of the laws beside it could."""
    if not (before.space.hypotheses and static(before)) or same_law(before, after) or problem.louder > 1.0:
        return False
    if rms(before.r) < problem.floor:
        return False
    block = blocks(problem, after)
    if after.cost > BEYOND * before.cost or by_noise(before, after) > NEVER or p_value(after, before, block) > LUCK:
        return False
    least, other = freed(problem, before, after)
    return rms(other) < np.sqrt(BEYOND) * rms(least) and chance(other, least, block) < UNLIKELY


def spent(problem: Problem, base: Fit, fitted: Fit) -> bool:
    """Whether no further term can be `worth` a place beside those of `fitted`: what is left is noise, and no model can
    be much better than that."""
    if static(fitted) and np.sqrt(BEYOND) * rms(fitted.r) > QUIET * problem.floor:
        return False
    below = rms(discount(problem, base, fitted) * fitted.r) < problem.floor
    return below and bool(np.sqrt(MOST) * rms(fitted.r) < QUIET * problem.floor)


def at_end(before: Fit, after: Fit) -> bool:
    """Whether a term that `after` has more stands at the end of what its times, speeds or frequencies may be: it wants
    to be something else."""
    held = set(after.bound())
    return any(f"{h.name}.{c.name}" in held for h in more(before, after) for c in h.coordinates if c.kind == SHAPE)


def same_law(before: Fit, after: Fit) -> bool:
    """Whether what `after` has more looks like a law that `before` has at that very node, or anywhere on an axis, which
    is one body: it may be its form."""
    return any(
        (old.node == h.node or after.model.kind == "axis")
        and (h.term in TERMS[old.term].look_alikes or old.term in TERMS[h.term].look_alikes)
        for h in more(before, after)
        for old in before.space.hypotheses
    )


def more(before: Fit, after: Fit) -> list[Hypothesis]:
    """What `after` has and `before` has not."""
    there = {h.name for h in before.space.hypotheses}
    return [h for h in after.space.hypotheses if h.name not in there]


def sure(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether what is better by much is so by no accident: chance does one of the two to a machine that lacks nothing,
    and not both."""
    return after.cost < PLAIN * before.cost and by_accident(before, after, blocks(problem, after)) < SELDOM


def better(before: Fit, after: Fit) -> bool:
    """Whether a richer form of the same terms earns its numbers, whatever else is left over."""
    return after.merit < (1.0 - MATERIAL) * before.merit


def merit(fitted: Fit, weights: np.ndarray) -> float:
    """As `Fit.merit`, of weighed errors."""
    less = 0.5 * float(np.sum((1.0 - weights**2) * fitted.r**2))
    return (fitted.cost - less) * fitted.merit / fitted.cost


def discount(problem: Problem, base: Fit, fitted: Fit) -> np.ndarray:
    """Weights (n,) of errors where the terms of `fitted` do much: no law is the machine's own to the last per cent,
    and what its form misses asks for no second effect."""
    return 1.0 / np.sqrt(1.0 + (FORM * problem.loudness(base.r - fitted.r) / problem.floor) ** 2)


def complete(problem: Problem, base: Fit, fitted: Fit) -> bool:
    """Whether what is left is noise: of the sensor, or of random forces on the machine."""
    return quiet(problem, base, fitted) or problem.hiss(fitted.r)


def loud(problem: Problem, base: Fit) -> bool:
    """Whether the owner's model leaves so much that something is missing, named or not."""
    return problem.parted(base.r) or (base.rms > LOUD * problem.floor and not complete(problem, base, base))


def quiet(problem: Problem, base: Fit, fitted: Fit) -> bool:
    """Whether what is left is no more than the noise of the sensor."""
    return rms(discount(problem, base, fitted) * fitted.r) < COMPLETE * problem.floor


def enough(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether the terms of `after` explain so much that they may be named."""
    share = explained(problem, before, after)
    if not complete(problem, before, after):
        return share > ENOUGH and after.rms < max(LEFT * problem.floor, before.rms / LEFT)
    if problem.white is not None or sure(problem, before, after):
        return True
    restless = before.rms < LOUD * problem.floor or not quiet(problem, before, after)
    lucky = restless and after.cost > MOST * before.cost and by_noise(before, after) > NOWHERE
    if lucky and p_value(after, before, blocks(problem, after)) > UNLIKELY:
        return False
    if share > MOSTLY:
        return True
    # what frees the owner's values, or explains what is plainly there, need be no miracle
    released = bool(before.bound()) and not after.bound()
    plain = share > HALF and (released or not complete(problem, before, before))
    return p_value(after, before, problem.block) < (RELEASED if plain else LUCK)


def explained(problem: Problem, before: Fit, after: Fit) -> float:
    """Share of the error's excess over the noise floor that the terms of `after` explain."""
    floor = min(problem.floor, after.rms) ** 2
    return float(np.clip((before.rms**2 - after.rms**2) / max(before.rms**2 - floor, 1e-12), 0.0, 1.0))


def probabilities(fits: list[Fit], floor: float = 0.0) -> np.ndarray:
    """Weights of rival models by their sizes, their number of numbers and the likelihood of their errors.

    Of the errors only every `memory`-th counts, and what lies well below the noise `floor` counts as equal: there a law
    only follows the cut into counts. Source: Schwarz, Annals of Statistics 6 (1978), for the price of a number.
    """
    best = min(fits, key=lambda f: f.cost)
    count = len(best.r) / memory(best.r)
    costs = np.array([max(f.cost, 0.5 * len(f.r) * (QUIET * floor) ** 2, 1e-300) for f in fits])
    numbers = np.array([len(f.x) - f.space.nb for f in fits])
    log = 0.5 * count * np.log(costs / costs.min()) + 0.5 * numbers * np.log(max(count, 2.0))
    log -= np.array([unusual(f) for f in fits])
    w = np.exp(-np.clip(log - log.min(), 0.0, 700.0))
    return w / w.sum()
