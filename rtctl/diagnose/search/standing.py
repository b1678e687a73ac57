"""Acceptance of models: every effect has a significant size, and gains more than the law errors of the others."""

import numpy as np

from rtctl.diagnose.calibration import FIRST, FURTHER, FURTHER_POWER, FURTHER_SHARE, LAW_ERROR
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import amplitude, explained, explained_force
from rtctl.diagnose.likelihood.widths import faint
from rtctl.diagnose.search.extend import Known, Merit, key
from rtctl.plants.physics import TERMS


def merit_of(f: Fitted, odds: float) -> float:
    """Logarithm of the posterior of a combination, nats, up to a constant.

    `odds` is ln of the prior odds of one effect at one place.
    """
    return f.log_evidence - odds * len(f.space.hypotheses) - f.seldom


def adds(base: Fitted, fewer: Fitted, more: Fitted, merit: Merit) -> bool:
    """Whether a further effect gains enough evidence, exceeds the law errors of the other effects, and explains power.

    The effect exceeds the law errors in amplitude or in evidence. It explains a share of the power of the residual, or
    of the observer's force, under the other effects. Evidence counts only for an effect of another argument: the error
    of a law is a function of the law's own argument, and in a clean recording the evidence of a small error is large.
    """
    gained = merit(more) - merit(fewer)
    if gained < FURTHER or not fewer.names:
        return gained >= FURTHER
    others = {argument(h.term) for h in fewer.space.hypotheses}
    apart = any(argument(h.term) not in others for h in more.space.hypotheses)
    clear = apart and gained > FURTHER_SHARE * (merit(more) - merit(base))
    large = clear or amplitude(base, fewer, more) > LAW_ERROR
    return large and max(explained(fewer, more), explained_force(fewer, more)) > FURTHER_POWER


def argument(term: str) -> str:
    """Argument of a term's law; an angle of less than a turn is a position."""
    axis = TERMS[term].axis
    return "position" if axis == "angle" else axis


def standing(base: Fitted, known: Known, merit: Merit) -> list[Fitted]:
    """Accepted models, best first."""
    return sorted((f for f in known.values() if stands(base, f, known, merit)), key=merit, reverse=True)


def stands(base: Fitted, f: Fitted, known: Known, merit: Merit) -> bool:
    """Whether a combination is accepted: each effect has a significant size and adds to the model without it.

    A model without one effect is compared only where it was fitted.
    """
    if not np.isfinite(f.log_evidence):
        return False
    if not f.names:
        return True
    if faint(f):
        return False
    if len(f.names) == 1:
        return merit(f) > merit(base) + FIRST
    rest = (key(set(f.names) - {name}) for name in f.names)
    return all(adds(base, known[names], f, merit) for names in rest if names in known)
