"""Exchange of the effects of a model for others that may explain the recording as well.

Each effect is replaced by others, and so are all effects of one node together: two wrong laws may together stand for
the right one.
"""

from collections.abc import Sequence

from rtctl.diagnose.likelihood.fits import Fitted, finished, refit, without
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.space import Hypothesis
from rtctl.diagnose.search.extend import Known, Merit, extended, key
from rtctl.diagnose.search.screen import Screened
from rtctl.plants.physics import TERMS

OTHERS = 3  # terms that are refitted beside the reduced model


def exchanged(like: Likelihood, base: Fitted, best: Fitted, known: Known, looked: Screened, merit: Merit) -> None:
    """Fit other effects in the place of each effect of the best model, and of all effects of a node, into `known`.

    `looked` holds the screening scores beside the base.
    """
    alone = len(best.names) == 1  # beside the base, all other effects are fitted already
    gone = [
        (rest, [h])
        for rest, h in zip([base] if alone else smaller(like, best, known), best.space.hypotheses, strict=True)
    ]
    for rest, these in (*gone, *emptied(like, best, known)):
        known[key(rest.names)] = rest
        most, told = (0, [looked]) if alone else (OTHERS, None)
        for f in extended(like, [rest], known, most, merit, told, look_alikes(these)):
            if merit(f) > merit(best):  # a model is accepted only if it needs all of its effects
                known |= {key(g.names): g for g in smaller(like, f, known)}


def look_alikes(effects: Sequence[Hypothesis]) -> set[str]:
    """Names (term:node) of the look-alikes of effects, at their nodes."""
    return {f"{other}:{h.node}" for h in effects for other in TERMS[h.term].look_alikes}


def emptied(like: Likelihood, f: Fitted, known: Known) -> list[tuple[Fitted, list[Hypothesis]]]:
    """Models without the effects of one node, for each node with several effects, and the effects left out."""
    out = []
    for node in dict.fromkeys(h.node for h in f.space.hypotheses):
        these = [index for index, h in enumerate(f.space.hypotheses) if h.node == node]
        if len(these) > 1:
            out.append((lacking(like, f, known, *these), [f.space.hypotheses[index] for index in these]))
    return out


def smaller(like: Likelihood, f: Fitted, known: Known, which: Sequence[int] | None = None) -> list[Fitted]:
    """Models without one effect each, for all effects of a model with several, or for those in `which`."""
    every = range(len(f.names)) if len(f.names) > 1 else ()
    return [lacking(like, f, known, index) for index in every if which is None or index in which]


def lacking(like: Likelihood, f: Fitted, known: Known, *indices: int) -> Fitted:
    """The model without some of its effects, fitted to convergence."""
    rest = known.get(key(set(f.names) - {f.names[index] for index in indices}))
    return finished(rest) if rest is not None else refit(like, *without(f, *indices))
