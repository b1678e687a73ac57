"""Models with a gross error in one number of the description: rivals of effects with the same signature.

A nominal value is wrong within its tolerance, or has a gross error: another unit, another gear, a command that the
drive does not follow. An effect is named only where it is likelier than a gross error. Errors of dry and viscous
friction and of the known effects are effects of the library.

Source: O'Hagan, On outlier rejection phenomena in Bayes inference, JRSS B 41 (1979), for a prior with heavy tails.
"""

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.model.model import PHYSICS
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.search.description_errors import FRICTION
from rtctl.diagnose.search.search import Found


def doubted(found: Found) -> tuple[Fitted, ...]:
    """Fits with a gross error of one number in the place of an effect, at most one for each model and number.

    The models are the description alone, and the best model without each of its effects. The numbers are those that the
    fit of the model took beyond their tolerance.
    """
    best = found.best
    fewer = [refit(best.like, *without(best, index)) for index in range(len(best.names))] if best.names[1:] else []
    return tuple(
        refit(f.like, f.space._replace(doubted=name), f.x, f.J) for f in (found.base, *fewer) for name in outside(f)
    )


def outside(f: Fitted) -> list[str]:
    """Names of the numbers that a fit took beyond their tolerance, unless their error is an effect of the library."""
    values = zip(f.space.names, f.x, strict=False)
    return [name for name, x in values if no_effect(name) and out_of_tolerance(f.space, name, x)]


def no_effect(name: str) -> bool:
    """Whether no effect of the library is an error of this number."""
    return not name.startswith(PHYSICS) and not name.endswith(FRICTION)


def out_of_tolerance(space: Space, name: str, x: float) -> bool:
    """Whether a number x, ln of its ratio to the nominal value, is outside its tolerance."""
    tol = space.tolerance(name)
    return bool(np.isfinite(tol)) and not np.log1p(-min(tol, 0.95)) <= x <= np.log1p(tol)
