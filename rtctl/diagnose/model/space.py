"""Parameter space of a fit: nominal parameters within their tolerance, and the coordinates of the hypotheses.

x holds, in order, ln(value / nominal value) of each plant parameter, then the coordinates of each hypothesis. A
coordinate is a size in units of its scale, the logarithm of a shape (a speed, a time, a frequency) over its scale, or
the cosine or sine part of an amplitude and phase: the phase is ill-conditioned at a small amplitude. The place of rest
of a spring is fitted as the force at that place: the place is ill-conditioned at a small stiffness.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.diagnose.calibration import BEYOND, FACTOR, TOLERANCE
from rtctl.idiom import Settings
from rtctl.plants.physics import TERMS

WIDE = 7.0  # logarithm, bound of a parameter without a tolerance
SIZE, INVERSE, SHAPE, COSINE, SINE, PLACE = "size", "inverse", "shape", "cosine", "sine", "place"
REST = "rest"
SOFTEST = 1e-6  # of the typical stiffness: least stiffness in the conversion to a place of rest


class Coordinate(NamedTuple):
    """Coordinate of a hypothesis. SINE follows COSINE; their name is amplitude and phase, split by a bar. REST follows
    the SIZE of its stiffness; its scale is that of the spring force at `offset`."""

    name: str
    kind: str
    scale: float  # SI
    low: float = -np.inf  # of x
    high: float = np.inf
    start: float = 0.0
    offset: float = 0.0  # SI, of a place, or of a size that is not 0 without the effect
    step: float = 1e-2  # of the difference quotient
    slight: float = 0.0  # size below which the effect is negligible


class Hypothesis(NamedTuple):
    """Term at a node, with the settings that are not fitted."""

    term: str
    node: str
    coordinates: tuple[Coordinate, ...]
    fixed: dict[str, Any] = {}  # noqa: RUF012

    @property
    def name(self) -> str:
        """term:node, as in `cannot_test`."""
        return f"{self.term}:{self.node}"

    @property
    def sizes(self) -> list[int]:
        """Indices of the coordinates that are zero without the effect."""
        return [i for i, c in enumerate(self.coordinates) if c.kind in (SIZE, INVERSE, COSINE, SINE, REST)]

    def values(self, x: Sequence[float] | np.ndarray) -> dict[str, float]:
        """Values of the parameters of the term at x, SI."""
        out: dict[str, float] = {}
        for i, c in enumerate(self.coordinates):
            if c.kind == SHAPE:
                out[c.name] = c.scale * float(np.exp(x[i]))
            elif c.kind == PLACE:
                out[c.name] = c.offset + c.scale * float(x[i])
            elif c.kind == COSINE:
                amplitude, phase = c.name.split("|")
                out[amplitude] = c.scale * float(np.hypot(x[i], x[i + 1]))
                out[phase] = float(np.arctan2(x[i + 1], x[i]))
            elif c.kind == REST:
                k = self.coordinates[i - 1]
                share = float(np.copysign(max(abs(x[i - 1]), SOFTEST), x[i - 1]))
                out[k.name] = k.scale * share
                out[c.name] = c.offset + c.scale * float(x[i]) / (k.scale * share)
            elif c.kind == INVERSE:
                out[c.name] = c.scale / max(float(x[i]), 1e-9)
            elif c.kind == SIZE:
                out[c.name] = c.offset + c.scale * float(x[i])
        return out

    def settings(self, x: Sequence[float] | np.ndarray) -> Settings:
        """Entry of a `physics:` list at x."""
        values = {**self.fixed, **self.values(x)}
        return TERMS[self.term].settings.model_construct(
            **{**_defaults(self.term), "term": self.term, "node": self.node, **values}
        )

    def start(self) -> np.ndarray:
        """Start x (coordinates,): shapes at their first guess, sizes zero."""
        return np.array([c.start for c in self.coordinates])


_known: dict[str, dict[str, Any]] = {}


def _defaults(term: str) -> dict[str, Any]:
    if term not in _known:
        fields = TERMS[term].settings.model_fields.items()
        _known[term] = {n: f.get_default(call_default_factory=True) for n, f in fields if not f.is_required()}
    return _known[term]


class Space(NamedTuple):
    """Model with its unknowns."""

    owner: Any  # the nominal model (model/model.py)
    names: tuple[str, ...]  # plant parameters
    tolerance: Callable[[str], float]
    hypotheses: tuple[Hypothesis, ...] = ()
    doubted: str = ""  # path of the parameter with a wide prior; empty for none

    @property
    def nb(self) -> int:
        """Number of plant parameters, which come first in x."""
        return len(self.names)

    def model(self, x: np.ndarray) -> Any:
        """Model at x."""
        base = dict(self.owner.base)
        for name, value in zip(self.names, x[: self.nb], strict=True):
            for each in self.owner.tied(name):
                base[each] = self.owner.base[each] * float(np.exp(value))
        terms = list(self.owner.terms)
        for hypothesis, part in zip(self.hypotheses, self.parts(x), strict=True):
            terms.append(hypothesis.settings(part))
        return self.owner._replace(base=base, terms=tuple(terms))

    def parts(self, x: np.ndarray) -> list[np.ndarray]:
        """Coordinates of each hypothesis, parts of x."""
        out, at = [], self.nb
        for hypothesis in self.hypotheses:
            out.append(x[at : at + len(hypothesis.coordinates)])
            at += len(hypothesis.coordinates)
        return out

    def columns(self, index: int) -> np.ndarray:
        """Indices in x of the coordinates of one hypothesis."""
        at = self.nb + sum(len(h.coordinates) for h in self.hypotheses[:index])
        return np.arange(at, at + len(self.hypotheses[index].coordinates))

    def start(self) -> np.ndarray:
        """Start x (unknowns,): nominal values, effects of size zero."""
        return np.concatenate([np.zeros(self.nb), *(h.start() for h in self.hypotheses)])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of x, (unknowns,) each."""
        low, high = [], []
        for name in self.names:
            tol = np.inf if name == self.doubted else BEYOND * self.tolerance(name)
            low.append(-WIDE if not np.isfinite(tol) else np.log1p(-min(tol, 0.95)))
            high.append(WIDE if not np.isfinite(tol) else np.log1p(tol))
        for h in self.hypotheses:
            low += [c.low for c in h.coordinates]
            high += [c.high for c in h.coordinates]
        return np.array(low, float), np.array(high, float)

    def prior(self) -> np.ndarray:
        """Prior precision (unknowns,): nominal values by their tolerance, 0 for coordinates of effects."""
        weights = []
        for name in self.names:
            spread = np.log(FACTOR) if name == self.doubted else TOLERANCE * self.tolerance(name)
            weights.append(1.0 / spread**2 if np.isfinite(spread) else 0.0)
        return np.array(weights + [0.0] * (len(self.start()) - self.nb))

    def steps(self) -> np.ndarray:
        """Steps of the difference quotients (unknowns,)."""
        return np.array([2e-3] * self.nb + [c.step for h in self.hypotheses for c in h.coordinates])

    def add(self, *hypotheses: Hypothesis) -> "Space":
        """Space with further hypotheses."""
        return self._replace(hypotheses=(*self.hypotheses, *hypotheses))

    def model_without(self, index: int, x: np.ndarray) -> Any:
        """Model at x without one of the hypotheses."""
        return self.without(index).model(np.delete(x, self.columns(index)))

    def model_believed(self, x: np.ndarray) -> Any:
        """Model at x with the nominal value of the doubted parameter."""
        x = x.copy()
        x[self.names.index(self.doubted)] = 0.0
        return self._replace(doubted="").model(x)

    def without(self, index: int) -> "Space":
        """Space without one of the hypotheses."""
        return self._replace(hypotheses=(*self.hypotheses[:index], *self.hypotheses[index + 1 :]))
