"""Withdrawal of names: held-out rows are predicted as well without the name, or worse with the name."""

from rtctl.diagnose.calibration import FIRST, WORSE
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED
from rtctl.diagnose.evidence.prediction import Heldout, predicted
from rtctl.diagnose.evidence.predictive import predictive
from rtctl.diagnose.evidence.verdict import Verdict, fewer
from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.likelihood.widths import faint
from rtctl.diagnose.search.search import Found


def told(decided: Verdict, heldout: Heldout, found: Found) -> tuple[Verdict, Heldout, Fitted]:
    """Verdict without effects whose size may be zero in the best predictor, its held-out errors, and the predictor.

    The remaining effects are accepted if their gain over the base exceeds the threshold of a first effect.
    """
    predictor = predictive(decided, heldout)
    while len(decided.best.names) > 1 and decided.verdict in (NAMED, AMBIGUOUS):
        idle = {predictor.names[index] for index in faint(predictor)}
        index = next((i for i, name in enumerate(decided.best.names) if name in idle), None)
        if index is None:
            break
        rest = refit(decided.best.like, *without(decided.best, index))
        if found.merit(rest) < found.merit(found.base) + FIRST:
            why = f"{', '.join(rest.names)} counts only beside {decided.best.names[index]}, whose size may be zero"
            gone = decided._replace(verdict=NOTHING, best=found.base, confidence=(), rivals=(), why=why)
            return gone, predicted(heldout, found.base), found.base
        decided, heldout = fewer(decided, rest, "the held-out rows are predicted as well"), predicted(heldout, rest)
        predictor = predictive(decided, heldout)
    return decided, heldout, predictor


def borne_out(decided: Verdict, heldout: Heldout) -> Verdict:
    """Verdict, unnamed where the names predict held-out rows worse than the nominal model alone."""
    if decided.verdict not in (NAMED, AMBIGUOUS) or not decided.best.names or heldout.gain > -WORSE:
        return decided
    names = ", ".join(decided.best.names)
    why = f"with {names} the held-out rows are predicted worse than without, by {-heldout.gain:.3g} nats"
    return decided._replace(verdict=UNNAMED, confidence=(), rivals=(), why=why)
