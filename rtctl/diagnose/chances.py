"""Chances that one model does better than another by luck alone.

Errors of neighbouring ticks are not independent: what is counted are blocks of them, longer than the memory of the
machine, or of what is left.

Source: Vuong, Econometrica 57 (1989), with the long-run variance of Andrews, Econometrica 59 (1991).
"""

import numpy as np
from scipy.stats import chi2, t

from rtctl.diagnose.fit import Fit
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.stretches import in_blocks, memory

SPANS, LONGEST = 2.0, 4000  # times the memory of what is left: blocks, where that is no noise; and the most, in ticks
FEW = 4  # blocks, fewer of which prove nothing


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
