"""Models in which one number of the description is wrong by a factor: rivals of effects that do the same.

An owner's number is wrong within its tolerance, or by far: another unit, another gear, a command that the drive does
not follow. A name stands only where it is likelier than such an error. Dry and viscous friction and the effects that
the owner knows have names of their own for what they lack.

Source: O'Hagan, On outlier rejection phenomena in Bayes inference, JRSS B 41 (1979), for a prior with heavy tails.
"""

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.model.model import PHYSICS
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.search.description_errors import FRICTION
from rtctl.diagnose.search.search import Found


def doubted(found: Found) -> tuple[Fitted, ...]:
    """Fits (at most one a model and number) with one number free of its tolerance in the place of an effect: beside the
    description alone, and beside the best model without each of its effects. A number is asked where the fit took it
    beyond its tolerance."""
    best = found.best
    fewer = [refit(best.like, *without(best, index)) for index in range(len(best.names))] if best.names[1:] else []
    return tuple(
        refit(f.like, f.space._replace(doubted=name), f.x, f.J) for f in (found.base, *fewer) for name in outside(f)
    )


def outside(f: Fitted) -> list[str]:
    """Numbers that a fit took out of their tolerance, but for those whose error is an effect of the library."""
    values = zip(f.space.names, f.x, strict=False)
    return [name for name, x in values if no_effect(name) and out_of_tolerance(f.space, name, x)]


def no_effect(name: str) -> bool:
    """Whether no effect of the library is an error of this number."""
    return not name.startswith(PHYSICS) and not name.endswith(FRICTION)


def out_of_tolerance(space: Space, name: str, x: float) -> bool:
    """Whether a number, ln of its ratio to the owner's value, is outside its tolerance."""
    tol = space.tolerance(name)
    return bool(np.isfinite(tol)) and not np.log1p(-min(tol, 0.95)) <= x <= np.log1p(tol)
