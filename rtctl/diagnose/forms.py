"""Other forms of a hypothesis: richer ones, those that differ by a setting, and the same law by another name.

A search begins with the plain form. Once that stands, the record is asked for harmonics, for a second branch, for
another shape of the same physics; and where two names of the library are one law, for the other name.
"""

from collections.abc import Iterator

import numpy as np

from rtctl.diagnose.hypotheses import starts_of
from rtctl.diagnose.record import Record
from rtctl.diagnose.scales import node_scales
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.yardstick import Measures
from rtctl.plants.physics import TERMS, nodes, standing
from rtctl.plants.physics.search import Choice, Hint, Where

NEARLY_WHOLE = 1e-3  # how near a fit comes to a whole number
NO_SWING = 3.0  # damping of a second-order lag, whose faster half is 34 times faster by then


def richer(record: Record, base: dict[str, float], h: Hypothesis) -> Hypothesis | None:
    """The same hypothesis with the further parameters of its richer form; None where it has none."""
    term = TERMS[h.term]
    found = standing(term, record.plant, h.node)
    if not term.richer or (term.richer_at and (found is None or found[1].kind != term.richer_at)):
        return None
    measures = Measures(record, base, node_scales(record, base), {})
    if is_rich(h):
        return None
    more = starts_of(h.term, h.node, term.richer, measures)[0]
    return h._replace(coordinates=(*h.coordinates, *more.coordinates), fixed={**h.fixed, **more.fixed})


def is_rich(h: Hypothesis) -> bool:
    """Whether it has its richer form already."""
    more = {part[0] for part in TERMS[h.term].richer if not isinstance(part, Choice)}
    return any(c.name.partition("|")[0] in more for c in h.coordinates)


def as_harmonic(h: Hypothesis, x: np.ndarray, span: float) -> Iterator[tuple[Hypothesis, np.ndarray]]:
    """The wave of a richer form as the second and the third of a longer one, which errors that are judged on track
    show less of than of its harmonics; no longer than the `span` of its node in m, so that it comes once at least."""
    names = [c.name for c in h.coordinates]
    long = next((names.index(hint.name) for hint in waves(h.term) if hint.name in names), None)
    if long is None or not is_rich(h):
        return
    for k in (2, 3):
        coordinates, y = list(h.coordinates), h.start()
        scale = k * coordinates[long].scale
        longest = min(coordinates[long].high, float(np.log(span / scale)))
        if x[long] >= longest:
            return
        coordinates[long] = coordinates[long]._replace(scale=scale, high=longest)
        y[long] = x[long]
        first, other = names.index("A|phi"), names.index(f"A{k}|phi{k}")
        for i in (0, 1):  # cosine and sine
            y[other + i] = x[first + i] * coordinates[first].scale / coordinates[other].scale
        yield h._replace(coordinates=tuple(coordinates)), y


def forms(h: Hypothesis) -> list[Hypothesis]:
    """The same hypothesis in each of its other forms."""
    term = TERMS[h.term]
    if term.variants is None:
        return []
    name, values, _ = term.variants
    default = term.settings.model_fields[name].default
    return [h._replace(fixed={**h.fixed, name: v}) for v in values if v != h.fixed.get(name, default)]


def about_others(record: Record, base: dict[str, float], h: Hypothesis) -> list[Hypothesis]:
    """The same hypothesis about each other place that it may be about: beside a push that has a name of its own, what
    was taken for the middle of the travel may be the start."""
    parts = tuple(part for part in TERMS[h.term].search if isinstance(part, Where))
    if not parts:
        return []
    rest = {name: value for name, value in h.fixed.items() if name not in {part.name for part in parts}}
    measures = Measures(record, base, node_scales(record, base), {})
    tried = (h._replace(fixed={**rest, **other.fixed}) for other in starts_of(h.term, h.node, parts, measures))
    return [other for other in tried if other.fixed != h.fixed]


def moved_into(form: Hypothesis, x: np.ndarray) -> list[np.ndarray]:
    """Starts of another form at x of the first: as it is, and what took one flank of a hill for a bump by itself is
    moved aside."""
    if form.fixed.get("form") != "hill":
        return [x]
    names = [c.name for c in form.coordinates]
    force, at = names.index("F"), names.index("at")
    starts = [x]
    for side in (-1.0, 1.0):  # it pushes on behind its middle and back before it
        y = x.copy()
        y[at] += side * form.values(x)["width"] / form.coordinates[at].scale
        y[force] *= -side
        starts.append(y)
    return starts


def rounded(h: Hypothesis, x: np.ndarray) -> tuple[int, Hypothesis] | None:
    """The same hypothesis with its order at the whole number that it is next to at x, and which coordinate it loses by
    that; None where it has no order or one in between."""
    for i, c in enumerate(h.coordinates):
        order = c.scale * float(np.exp(x[i])) if c.name in TERMS[h.term].counted else 0.0
        if order > 0.5 and abs(order / round(order) - 1.0) < NEARLY_WHOLE:
            rest = (*h.coordinates[:i], *h.coordinates[i + 1 :])
            return i, h._replace(coordinates=rest, fixed={**h.fixed, c.name: float(round(order))})
    return None


def of_first_order(h: Hypothesis, x: np.ndarray) -> tuple[Hypothesis, np.ndarray] | None:
    """The first-order lag that a second-order one comes to at x where it is damped far beyond any swing, and its x;
    None for anything else."""
    names = [c.name for c in h.coordinates]
    if h.fixed.get("order") != 2 or "zeta" not in names or h.values(x)["zeta"] < NO_SWING:
        return None
    zeta, y = names.index("zeta"), np.array(x)
    y[names.index("tau")] *= 2.0 * h.values(x)["zeta"]  # (s tau)^2 + 2 zeta s tau + 1, where s is small
    rest = tuple(c for i, c in enumerate(h.coordinates) if i != zeta)
    return h._replace(coordinates=rest, fixed={**h.fixed, "order": 1}), np.delete(y, zeta)


def renamed(plant: str, h: Hypothesis, x: np.ndarray) -> Hypothesis | None:
    """The same law by its other name, at the same x: a wave that a sliding axis misreads is of its screw or encoder, or
    of its guide, and at lengths that both may have nothing tells them apart. None where it has no other name."""
    other = TERMS[h.term].other_name
    if other is None or other.own not in (c.name for c in h.coordinates):
        return None
    if h.node not in nodes(TERMS[other.term], plant):
        return None
    shortest, longest = next(hint.lengths for hint in waves(other.term) if hint.name == other.name)
    if not shortest < h.values(x)[other.own] < longest:
        return None
    coordinates = tuple(c._replace(name=other.name) if c.name == other.own else c for c in h.coordinates)
    return h._replace(term=other.term, coordinates=coordinates)


def waves(term: str) -> list[Hint]:
    """Lengths of waves among what is fitted of a term."""
    parts = (*TERMS[term].sliding, *TERMS[term].search)
    return [part for part in parts if isinstance(part, Hint) and part.kind == "wavelength"]
