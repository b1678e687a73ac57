"""Whether the sizes that a fit came to are those of a machine, and how usual they are."""

import numpy as np

from rtctl.diagnose.fit import Fit
from rtctl.diagnose.space import COSINE, SIZE
from rtctl.plants.physics import TERMS, Term, standing
from rtctl.plants.physics.search import Size

OFTEN = 1.5  # factor beyond the typical sizes that is one standard deviation
ABSURD = 30.0  # times the largest typical size


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
        if any(values.get(name, 0.0) < 0.0 for name in frictions(term)):
            total -= 2.0
        there = standing(term, fitted.model.kind, h.node)
        for name, (low, high) in term.typical.items():
            size = abs(values.get(name, 0.0))
            known = name not in term.scale and (there is None or there[0].usual)
            if known and size > 0.0:
                total -= 0.5 * min(max(np.log(low / size), np.log(size / high), 0.0) / np.log(OFTEN), 3.0) ** 2
    return float(total)


def frictions(term: Term) -> list[str]:
    """Sizes that are frictions themselves, of which a negative one takes from what the owner has."""
    return [part.name for part in term.search if isinstance(part, Size) and part.undoes]
