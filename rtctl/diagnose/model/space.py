"""What a fit may move: the owner's parameters within their tolerance, and the numbers of the terms on trial.

x holds, in order, ln(value / owner's value) of each plant parameter, then the coordinates of each hypothesis. A
coordinate is a size in units of its scale, or the logarithm of a shape (a speed, a time, a frequency) over its scale,
or one of a pair that makes amplitude and phase: the cosine and sine parts are well-behaved where an angle is not. The
place at which a spring rests is fitted as the push that it makes of it: where the stiffness is small a place is not
well-behaved, a push is.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.diagnose.calibration import BEYOND, FACTOR, TOLERANCE
from rtctl.idiom import Settings
from rtctl.plants.physics import TERMS

WIDE = 7.0  # in logarithm, of a parameter of which the owner knows nothing
SIZE, INVERSE, SHAPE, COSINE, SINE, PLACE = "size", "inverse", "shape", "cosine", "sine", "place"
REST = "rest"
SOFTEST = 1e-6  # of its typical size: least stiffness by which a place of rest is told


class Coordinate(NamedTuple):
    """One number of a hypothesis. COSINE is followed by SINE; their name is amplitude and phase, split by a bar. REST
    follows the SIZE of its stiffness; its scale is of the force with which the spring pulls at `offset`."""

    name: str
    kind: str
    scale: float  # SI
    low: float = -np.inf  # of x
    high: float = np.inf
    start: float = 0.0
    offset: float = 0.0  # SI, of a place, or of a size that is not 0 where the effect is none
    step: float = 1e-2  # of the difference quotient
    slight: float = 0.0  # size below which it is missed by nobody


class Hypothesis(NamedTuple):
    """One term at one node, with the choices that are not fitted."""

    term: str
    node: str
    coordinates: tuple[Coordinate, ...]
    fixed: dict[str, Any] = {}  # noqa: RUF012

    @property
    def name(self) -> str:
        """As in `cannot_test`: term:node."""
        return f"{self.term}:{self.node}"

    @property
    def sizes(self) -> list[int]:
        """Indices of the coordinates that are zero where the effect is."""
        return [i for i, c in enumerate(self.coordinates) if c.kind in (SIZE, INVERSE, COSINE, SINE, REST)]

    def values(self, x: Sequence[float] | np.ndarray) -> dict[str, float]:
        """SI values of the term's parameters at x."""
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
        """The entry of a `physics:` list."""
        values = {**self.fixed, **self.values(x)}
        return TERMS[self.term].settings.model_construct(
            **{**_defaults(self.term), "term": self.term, "node": self.node, **values}
        )

    def start(self) -> np.ndarray:
        """x where its shapes are as first guessed and its size is zero."""
        return np.array([c.start for c in self.coordinates])


_known: dict[str, dict[str, Any]] = {}


def _defaults(term: str) -> dict[str, Any]:
    if term not in _known:
        fields = TERMS[term].settings.model_fields.items()
        _known[term] = {n: f.get_default(call_default_factory=True) for n, f in fields if not f.is_required()}
    return _known[term]


class Space(NamedTuple):
    """A model with all that may move in it."""

    owner: Any  # the nominal model (graph/model.py)
    names: tuple[str, ...]  # plant parameters
    tolerance: Callable[[str], float]
    hypotheses: tuple[Hypothesis, ...] = ()
    doubted: str = ""  # the parameter that may be wrong by a factor, if one

    @property
    def nb(self) -> int:
        """Number of plant parameters, which come first in x."""
        return len(self.names)

    def model(self, x: np.ndarray) -> Any:
        """The model at x."""
        base = dict(self.owner.base)
        for name, value in zip(self.names, x[: self.nb], strict=True):
            for each in self.owner.tied(name):
                base[each] = self.owner.base[each] * float(np.exp(value))
        terms = list(self.owner.terms)
        for hypothesis, part in zip(self.hypotheses, self.parts(x), strict=True):
            terms.append(hypothesis.settings(part))
        return self.owner._replace(base=base, terms=tuple(terms))

    def parts(self, x: np.ndarray) -> list[np.ndarray]:
        """The coordinates of each hypothesis."""
        out, at = [], self.nb
        for hypothesis in self.hypotheses:
            out.append(x[at : at + len(hypothesis.coordinates)])
            at += len(hypothesis.coordinates)
        return out

    def columns(self, index: int) -> np.ndarray:
        """Where in x the coordinates of one hypothesis stand."""
        at = self.nb + sum(len(h.coordinates) for h in self.hypotheses[:index])
        return np.arange(at, at + len(self.hypotheses[index].coordinates))

    def start(self) -> np.ndarray:
        """The owner's values, and nothing of any effect."""
        return np.concatenate([np.zeros(self.nb), *(h.start() for h in self.hypotheses)])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x."""
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
        """Weight of x^2 in the cost: the owner's values count for what they are worth, an effect is free."""
        weights = []
        for name in self.names:
            spread = np.log(FACTOR) if name == self.doubted else TOLERANCE * self.tolerance(name)
            weights.append(1.0 / spread**2 if np.isfinite(spread) else 0.0)
        return np.array(weights + [0.0] * (len(self.start()) - self.nb))

    def steps(self) -> np.ndarray:
        """Steps of the difference quotients."""
        return np.array([2e-3] * self.nb + [c.step for h in self.hypotheses for c in h.coordinates])

    def add(self, *hypotheses: Hypothesis) -> "Space":
        """With more hypotheses."""
        return self._replace(hypotheses=(*self.hypotheses, *hypotheses))

    def model_without(self, index: int, x: np.ndarray) -> Any:
        """The model at x, without one of the hypotheses."""
        return self.without(index).model(np.delete(x, self.columns(index)))

    def model_believed(self, x: np.ndarray) -> Any:
        """The model at x, with the owner's value of the doubted parameter."""
        x = x.copy()
        x[self.names.index(self.doubted)] = 0.0
        return self._replace(doubted="").model(x)

    def without(self, index: int) -> "Space":
        """With one hypothesis less."""
        return self._replace(hypotheses=(*self.hypotheses[:index], *self.hypotheses[index + 1 :]))
