"""Replacement of an effect of which only a constant force is identified by an effect that is a constant force.

A spring whose stiffness may be zero, far from its place of rest, acts as a constant force. Its further free parameter
improves the fit a little, and the recording does not identify it.
"""

from rtctl.diagnose.calibration import VISIBLE
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED
from rtctl.diagnose.evidence.verdict import Verdict, combinations, of_names
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import explained
from rtctl.diagnose.likelihood.widths import hollow


def filled(decided: Verdict, base: Fitted) -> Verdict:
    """Verdict in which another effect replaces each effect whose own size may be zero, where a fitted model with the
    other effect explains nearly as much."""
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
    """Likeliest model with another effect in the place of effect `index`, with all sizes identified; None where no such
    model explains nearly as much as the best."""
    best = decided.best
    rest = {name for i, name in enumerate(best.names) if i != index}
    enough = explained(base, best) - VISIBLE
    fits = [
        r.fit for r in decided.table
        if not r.unlisted and len(r.fit.names) == len(best.names) and rest < set(r.fit.names)
        and best.names[index] not in r.fit.names and not hollow(r.fit) and explained(base, r.fit) > enough
    ]  # fmt: skip
    return max(fits, key=lambda f: f.log_evidence, default=None)
