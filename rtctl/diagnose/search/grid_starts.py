"""Starts of a hypothesis: grid of initial parameters of a term at a node.

Each term declares the search of its parameters (plants/physics/search.py). Starts are shares of measures of the node in
the recording: its rms speed, its span, the rms force of its drive.
"""

from collections.abc import Iterable
from itertools import product

import numpy as np

from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.model.space import COSINE, INVERSE, PLACE, REST, SHAPE, SINE, SIZE, Coordinate, Hypothesis
from rtctl.own.term import sizes
from rtctl.plants.physics import TERMS, Element, Term, having
from rtctl.plants.physics.search import At, Hint, Jumps, Limit, Part, Rest, Shape, Size, Turn, Where

TURN = 0.1  # rad: largest phase shift at the far end of a ripple in a difference quotient


def searched(name: str) -> bool:
    """Whether a term is among the hypotheses of every record."""
    return bool(sizes(name) or TERMS[name].search)


def shows_alone(term: Term, element: Element, slides: bool, unsigned: bool) -> bool:
    """Whether a lone sensor shows a term that usually needs a second sensor for comparison.

    A lone sensor shows it as the only sensor of the only body, or as a sensor of a speed that is never negative.
    """
    return {"slides": slides and "lone" in element.traits, "unsigned": unsigned}.get(term.needs.alone, False)


def parts_of(name: str) -> tuple[Part, ...]:
    """Fitted parts of a term; without a declared search, its typical values, of which the first is the size."""
    if TERMS[name].search:
        return TERMS[name].search
    (first, (low, high)), *others = TERMS[name].typical.items()
    more = (Shape(n, "one", ((a * b) ** 0.5,), (b / a) ** 0.5) for n, (a, b) in others)
    return (Size(first, "one", (low * high) ** 0.5), *more)


def starts_of(term: str, node: str, parts: tuple[Part, ...], m: Measures) -> list[Hypothesis]:
    """One hypothesis for each combination of starts."""
    m.term = term
    axes: list[list[tuple[tuple[Coordinate, ...], dict]]] = [list(_options(part, node, m)) for part in parts]
    out = []
    for combination in product(*axes):
        coordinates = tuple(c for option, _ in combination for c in option)
        fixed = {k: v for _, extra in combination for k, v in extra.items()}
        out.append(Hypothesis(term, node, coordinates, fixed))
    return out


def _options(part: Part, node: str, m: Measures) -> Iterable[tuple[tuple[Coordinate, ...], dict]]:
    if isinstance(part, Size):
        offset = m.dry(node) if part.offset == "dry" else 0.0
        shares = part.share if isinstance(part.share, tuple) else (part.share,)
        top = part.most if part.most < np.inf else 0.5 * m.most(part.name)
        for scale in dict.fromkeys(min(x * m.of(part.measure, node), top) for x in shares):
            least = part.least if part.signed else part.finest * m.of("grain", node) / scale
            if part.undoes:
                least = -(m.dry(node) if part.undoes == "dry" else m.thick(node)) / scale - 1e-3
            most = part.most / scale if part.measure == "one" else part.most
            slight = max(part.slight, m.of(part.blur, node) / scale if part.blur else 0.0)
            yield (Coordinate(part.name, SIZE, scale, least, most, offset=offset, slight=slight),), {}
    elif isinstance(part, Shape):
        measure = m.of(part.measure, node)
        low, high = min(part.starts) * measure / part.reach, max(part.starts) * measure * part.reach
        for start in part.starts:
            value = start * measure
            if part.fixed:
                yield (), {part.name: value}
            else:
                yield (Coordinate(part.name, SHAPE, value, np.log(low / value), np.log(high / value)),), {}
    elif isinstance(part, Limit):
        limits = [start * m.of(part.measure, node) for start in part.starts]
        for limit in limits or m.hints.get(f"{part.measure}:{node}", []):
            yield (Coordinate(part.name, INVERSE, limit, 0.0),), {}
    elif isinstance(part, Turn):
        scale = part.share * m.of(part.measure, node)
        name = f"{part.amplitude}|{part.phase}"
        yield (Coordinate(name, COSINE, scale), Coordinate(name, SINE, scale)), {}
    elif isinstance(part, Hint):
        found = m.hints.get(f"{part.kind}:{node}", m.hints.get(part.kind, []))
        s = m.scale(node)
        if node in having(m.record.plant, "sensor", "lone") and part.kind == "wavelength":
            low, high = part.lengths
            found = [value for value in found if low < value < high]
        if part.kind == "order" and node in having(m.record.plant, "body", "rotor"):
            found = [value for value in found if value > 1.0]  # order one of a rotor is unbalance; teeth are higher
        for value in found:
            if part.place:
                yield (Coordinate(part.name, PLACE, part.reach * s.span, -3.0, 3.0, offset=s.at(value)),), {}
            elif part.kind != "wavelength":  # an order is a whole number
                yield (), {part.name: value}
            else:
                turns = s.span * 2 * np.pi / value  # rad, along the whole travel
                step = min(1e-2, TURN / turns)
                longest = min(part.reach, float(np.log(turns / (2 * np.pi))))  # less than one wave fits any curve
                if longest > 0.0:
                    yield (Coordinate(part.name, SHAPE, value, -part.reach, longest, step=step),), {}
    elif isinstance(part, Where):
        yield (), {}
        yield (), {part.name: m.scale(node).at(0.5)}
    elif isinstance(part, Rest):
        yield (Coordinate(part.name, REST, part.share * m.of(part.measure, node), offset=m.scale(node).at(0.5)),), {}
    elif isinstance(part, Jumps):
        jumps = m.hints.get(f"jump:{node}", [])
        if jumps:
            tick, (_, first) = m.record.dt, jumps[0]  # counts are lost between two ticks: the later reads all of them
            (at, _), *more = [(max(when - tick, 0.0), size / first) for when, size in jumps]
            yield (Coordinate(part.name, SIZE, abs(first)),), {"at": at, "more": tuple(more), "over": tick}
    elif isinstance(part, At):
        s = m.scale(node)
        low, high = 0.2 * part.narrow * s.span, 4.0 * part.wide * s.span
        places = [((k + 0.5) / part.places, part.wide, 1.0 / part.places) for k in range(part.places)]
        spots = [(spot, part.narrow, 2 * part.narrow) for spot in m.hints.get("spot", [])]
        for where, share, reach in places + spots:
            width = share * s.span
            place = Coordinate(part.name, PLACE, reach * s.span, -1.5, 1.5, offset=s.at(where))
            yield (place, Coordinate(part.width, SHAPE, width, np.log(low / width), np.log(high / width))), {}
    else:
        for value in part.values:
            yield (), {part.name: value * m.of(part.measure, node) if part.measure else value}
