"""Names that a recording cannot test: a typical size would not show beside the numbers of the description.

What is found under such a name shows because a number is kept within its tolerance. It may as well be that number which
is wrong, by more than its owner thinks, or another name that does the same in this recording.
"""

from rtctl.diagnose.calibration import MOSTLY, SEEN
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import explained
from rtctl.diagnose.search.search import Found


def untestable(found: Found) -> frozenset[str]:
    """Hypotheses, as term:node, of which a typical size would not show in this recording."""
    norms: dict[str, float] = {}
    for score in found.scores:
        norms[score.hypothesis.name] = max(norms.get(score.hypothesis.name, 0.0), score.norm)
    return frozenset(name for name, norm in norms.items() if norm < SEEN)


def without_untestable(found: Found, best: Fitted, unsure: frozenset[str]) -> Fitted:
    """The best model without the names that cannot be tested, as far as the others take off most of what is missing."""
    for name in unsure & set(best.names):
        rest = next((f for f in found.fits if f.names and set(f.names) == set(best.names) - {name}), None)
        if rest is not None and explained(found.base, rest) >= MOSTLY:
            best = rest
    return best
