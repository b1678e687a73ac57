"""A name of which nothing shows but a force that is always there yields to one that is just that.

A spring whose stiffness may be zero, far from where it rests, is a constant push. Its free number is a licence: it fits
a little better than a push that has none, and says something that nobody has seen.
"""

from rtctl.diagnose.calibration import VISIBLE
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED
from rtctl.diagnose.evidence.verdict import Verdict, combinations, of_names
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import explained
from rtctl.diagnose.likelihood.widths import hollow


def filled(decided: Verdict, base: Fitted) -> Verdict:
    """The verdict with another name in the place of each whose own size may be zero, where a fitted model takes off
    nearly as much with it."""
    while decided.verdict in (NAMED, AMBIGUOUS) and (best := decided.best).names:
        other = next((f for i in hollow(best) if (f := instead(decided, base, i)) is not None), None)
        if other is None:
            return decided
        table = tuple(
            r._replace(fit=other) if r.fit.names == best.names and not r.unlisted else r for r in decided.table
        )
        decided = of_names(decided._replace(best=other, table=table, probabilities=combinations(table)))
    return decided


def instead(decided: Verdict, base: Fitted, index: int) -> Fitted | None:
    """The likeliest model with another effect than the one of this number, all of whose sizes are told; None where none
    takes off nearly as much as the best."""
    best = decided.best
    rest = {name for i, name in enumerate(best.names) if i != index}
    enough = explained(base, best) - VISIBLE
    fits = [
        r.fit for r in decided.table
        if not r.unlisted and len(r.fit.names) == len(best.names) and rest < set(r.fit.names)
        and best.names[index] not in r.fit.names and not hollow(r.fit) and explained(base, r.fit) > enough
    ]  # fmt: skip
    return max(fits, key=lambda f: f.log_evidence, default=None)
