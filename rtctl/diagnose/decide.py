"""Judges what the search found: is it there, is it enough, and is it ahead of everything that looks like it?

A term earns its place when it takes a material share off the error, beyond what the luckiest of all hypotheses takes
off a record with nothing in it. It earns its name when the model with it explains what there was to explain, down to
the noise, when no bound holds it, and when it beats each rival by more than chance, judged on blocks longer than the
machine's memory, since errors of neighbouring ticks are not independent.

Source: Vuong, Econometrica 57 (1989), with the long-run variance of Andrews, Econometrica 59 (1991).
"""

import numpy as np
from scipy.stats import chi2, t, wilcoxon

from rtctl.diagnose.anylaw import freed, static
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.space import COSINE, SHAPE, SIZE, Hypothesis
from rtctl.diagnose.stretches import in_blocks, memory, rms
from rtctl.plants.physics import TERMS

MATERIAL = 0.03  # share of the cost that a term must take off, beside its toll
LOUD = 4.5  # times the noise floor: below it what no hypothesis explains may be a machine that is not quiet
NEARLY = 0.1  # the same where the model is already near the noise
BESIDE = 0.5  # the same where more is left than noise, which the form of a law may account for
QUIET = 0.85  # of the noise floor, below which models are equally good
OFTEN = 1.5  # factor beyond the typical sizes that is one standard deviation
ABSURD = 30.0  # times the largest typical size
ELSEWHERE = (  # whose typical sizes are those of another machine: angles, or contacts of tape
    ("ripple.encoder", "axis"),
    ("transmission.backlash", "axis"),
    ("transmission.creep", "ldu"),
)
MOST = 0.3  # of the cost: a term that leaves less is more than the form of another, and nothing that chance does
LUCK = 1e-4  # chance that a term does so well there by luck
RELEASED, FREE = 2e-3, 0.2  # chance and share where a term frees plant parameters from the ends of their tolerance
SELDOM = 1e-8  # chance that a further term does by accident what it does, wherever that is
MEASURED = 1e-6  # the same of a first term, where the floor is the noise of this very record
SPANS, LONGEST = 2.0, 4000  # times the memory of what is left: blocks, where that is no noise; and the most, in ticks
NEVER = 1e-6  # the same of a term that no luck brings, whatever the number of its numbers
BEYOND = 0.75  # of the cost, once the laws beside a term may have any form
UNLIKELY = 1e-5  # chance of that, and of a name that explains less than most of what random forces may have done
NOWHERE = 1e-100  # chance of the same by noise at a few places: at rest, where friction creeps, 1e-72 was seen
CLEAR = 0.15  # share of the cost that it must take off
LESS = {"friction.coulomb": "F_C", "friction.viscous": "B"}  # sizes that are frictions themselves
COMPLETE = 1.75  # times the noise floor of a quiet machine: what is left may well be noise
FORM = 0.04  # of what a term does: what the form of its law may miss
HALF = 0.5  # of the excess explained, and not by luck: something is there; less may be what any number takes off
MOSTLY = 0.75  # share of the excess that a name must explain besides
ENOUGH = 0.97  # share of the excess that a name must explain where the floor is not reached
LEFT = 20.0  # times the floor, or part of what was there, that it may leave: any law takes a share of what is loud
FEW = 4  # blocks, fewer of which prove nothing


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


def by_noise(before: Fit, after: Fit) -> float:
    """Chance that noise alone takes so much off, however few the places where it does.

    Source: Wilks, Annals of Mathematical Statistics 9 (1938), with as many errors as are independent.
    """
    level = 2.0 * after.cost / len(after.r) * memory(after.r, LONGEST)
    return float(chi2.sf(2.0 * (before.cost - after.cost) / level, len(after.x) - len(before.x)))


def by_accident(before: Fit, after: Fit, block: int) -> float:
    """Chance that what `after` does otherwise than `before` has nothing to do with the machine.

    Its size is as sure as what is left lets it be, block by block: a term that acts at a few places is judged by the
    errors there, and one that acts everywhere but fits in one place is not borne out by the others. Counts as many
    blocks as share in what it does. Source: Liang & Zeger, Biometrika 73 (1986), for the spread; Satterthwaite,
    Biometrics Bulletin 2 (1946), for the count.
    """
    does = before.r - after.r
    power, agrees = (in_blocks(does * e, block) for e in (does, after.r))
    count = float(power.sum() ** 2 / max(float(power @ power), 1e-300))
    return float(t.sf(power.sum() / max(float(np.sqrt(agrees @ agrees)), 1e-300), max(count - 1.0, 1.0)))


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


def blocks(problem: Problem, fitted: Fit) -> int:
    """Errors in a block of a test where what is left need be no noise: longer than the memory of that."""
    return max(problem.block, round(SPANS * memory(fitted.r, LONGEST)))


def p_value(best: Fit, rival: Fit, block: int) -> float:
    """Chance that the rival explains the record as well as the best does (one-sided Vuong test on blocks)."""
    return chance(best.r, rival.r, block)


def chance(best: np.ndarray, rival: np.ndarray, block: int) -> float:
    """As `p_value`, of the errors (errors,) themselves; by Student's t, since few blocks do not tell their spread."""
    sums = ahead(best, rival, block)
    if len(sums) < FEW:
        return 1.0
    spread = float(np.std(sums, ddof=1)) * np.sqrt(len(sums))
    return float(t.sf(sums.sum() / max(spread, 1e-12), len(sums) - 1))


def ahead(best: np.ndarray, rival: np.ndarray, block: int) -> np.ndarray:
    """What the cost of the errors `best` (errors,) is below that of `rival` in each block."""
    return in_blocks(0.5 * (rival**2 - best**2), block)


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


def absurd(fitted: Fit) -> bool:
    """Whether a size is far beyond all that is typical: then it is a number that fits, and no machine's."""
    for h, x in zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True):
        term, values = TERMS[h.term], h.values(x)
        for c in h.coordinates:
            name = c.name.partition("|")[0]
            known = c.kind in (SIZE, COSINE) and name in term.typical and name not in term.scale
            if known and abs(values[name]) > ABSURD * term.typical[name][1]:
                return True
    return False


def slight(fitted: Fit) -> bool:
    """Whether a size is so small that nobody would miss it: long records show what the form of the owner's own law
    leaves, as dry friction of a hundredth of the force that drives."""
    return any(
        abs(value) < c.slight
        for h, x in zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True)
        for c, value in zip(h.coordinates, x, strict=True)
    )


def unlikely(fitted: Fit) -> bool:
    """Whether a model has a size that is `absurd` or `slight`."""
    return absurd(fitted) or slight(fitted)


def unusual(fitted: Fit) -> float:
    """Minus the logarithm of how likely sizes like these are: only what tells two equal laws apart.

    Within the term's typical range all are alike; beyond it a factor of OFTEN counts as one standard deviation.
    Friction that takes away counts as two: what a model lacks rubs, and an owner's value is right to its tolerance.
    """
    total = 0.0
    for h, x in zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True):
        term, values = TERMS[h.term], h.values(x)
        if values.get(LESS.get(h.term, ""), 0.0) < 0.0:
            total -= 2.0
        for name, (low, high) in term.typical.items():
            size = abs(values.get(name, 0.0))
            known = name not in term.scale and (h.term, fitted.model.kind) not in ELSEWHERE
            if known and size > 0.0:
                total -= 0.5 * min(max(np.log(low / size), np.log(size / high), 0.0) / np.log(OFTEN), 3.0) ** 2
    return float(total)
