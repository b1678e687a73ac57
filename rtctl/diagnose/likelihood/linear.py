"""Linear model of a fit: the residual as a function of the parameters about their fitted values, under a given noise.

Screening, starts of fits and free functions solve for the parameters beside a further function with it.
"""

from copy import copy
from functools import cached_property

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted, prior
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.solver import bounded_step
from rtctl.diagnose.model.space import Hypothesis
from rtctl.plants.physics import TERMS

DAMPING = 1e-9  # of a bounded step, relative


class Linear:
    """Derivatives of the residual of a fitted model: raw (blocks, sensors, unknowns), and white under a noise."""

    def __init__(self, base: Fitted):
        self.base, self.like = base, base.like
        self.start, self.coarse = base.like.rough(base.model)  # residuals that differences are taken from
        self._starts: dict[tuple[bool, bool], np.ndarray] = {(False, False): self.start}
        self.raw = np.asarray(base.J, float)
        self.weight = prior(base.space)

    def start_of(self, h: Hypothesis) -> np.ndarray:
        """Residual (blocks, sensors) of the base, SI, simulated in the step size of the term of a hypothesis.

        A difference between simulations of two step sizes would contain the integration error.
        """
        term = TERMS[h.term]
        steps = (term.stiff, term.slips) if h.sizes else (False, False)
        if steps not in self._starts:
            none = self.base.space.add(h).model(np.concatenate([self.base.x, h.start()]))
            self._starts[steps] = self.base.like.raw(none, self.coarse)
        return self._starts[steps]

    def under(self, like: Likelihood) -> "Linear":
        """Linear model under the noise of `like`."""
        other = copy(self)
        other.like = like
        for derived in ("white", "H"):
            other.__dict__.pop(derived, None)
        return other

    @cached_property
    def white(self) -> np.ndarray:
        """Derivatives of the innovations (innovations, unknowns)."""
        return self.like.white(self.raw)

    @cached_property
    def H(self) -> np.ndarray:
        """Second derivative (unknowns, unknowns) of the cost by Gauss and Newton, prior included."""
        return np.asarray(self.white.T @ self.white + np.diag(self.weight))

    def slope(self, r: np.ndarray) -> np.ndarray:
        """Derivative (unknowns,) of the cost where the innovations are r (innovations,)."""
        return np.asarray(self.white.T @ r + self.weight * self.base.x)

    def step(self, e: np.ndarray) -> np.ndarray:
        """Step (unknowns,) of the parameters to the least cost of the residuals e (blocks, sensors), within bounds."""
        low, high = self.base.space.bounds()
        return bounded_step(self.H, self.slope(self.like.white(e)), self.base.x, low, high, DAMPING)

    def left(self, dx: np.ndarray, C: np.ndarray) -> np.ndarray:
        """Residuals (blocks, sensors) after a step of the parameters and of the directions C (blocks, sensors, k)."""
        n = len(self.base.x)
        return np.asarray(self.base.e + np.tensordot(self.raw, dx[:n], axes=1) + np.tensordot(C, dx[n:], axes=1))
