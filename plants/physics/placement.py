"""Nodes at which a term can stand: those of the elements of a plant with the required traits."""

from functools import lru_cache

from rtctl.plants.element import GENERAL, Element, Stand
from rtctl.plants.physics.place import PLANTS
from rtctl.plants.physics.term import Term

Plant = str | tuple[Element, ...]  # a kind of plant, or the elements of one


def nodes(term: Term, plant: Plant) -> tuple[str, ...]:
    """Nodes where the term can stand: in the order of its stands, and of the elements for each of them."""
    return tuple(_stands(term.stands, elements(plant)))


def standing(term: Term, plant: Plant, node: str) -> tuple[Stand, Element] | None:
    """Stand of a term at a node, and the element of the node; None where the term cannot stand there."""
    return _stands(term.stands, elements(plant)).get(node)


def elements(plant: Plant) -> tuple[Element, ...]:
    """Elements of a kind of plant; none of a kind that has no nodes."""
    if not isinstance(plant, str):
        return plant
    return PLANTS[plant].ELEMENTS if plant in PLANTS else ()


def by_kind(term: Term) -> dict[str, tuple[str, ...]]:
    """Nodes by the kind of plant, of those on which the term can stand."""
    found = {kind: nodes(term, kind) for kind in PLANTS}
    return {kind: there for kind, there in found.items() if there}


def anywhere(term: Term) -> dict[str, tuple[str, ...]]:
    """As `by_kind`; for a term of described machines alone, its nodes if these plants were described machines."""
    return by_kind(term) or {
        kind: there for kind in PLANTS if (there := nodes(term, tuple(map(_general, elements(kind)))))
    }


def _general(element: Element) -> Element:
    alone = {"single"} if element.kind == "body" else {"path"} if "span" in element.traits else set()
    return element._replace(traits=element.traits | {GENERAL} | alone)


def having(plant: Plant, kind: str, trait: str) -> tuple[str, ...]:
    """Nodes of the elements of a kind that have a trait."""
    return tuple(e.node for e in elements(plant) if e.kind == kind and trait in e.traits)


@lru_cache(maxsize=1024)
def _stands(stands: tuple[Stand, ...], there: tuple[Element, ...]) -> dict[str, tuple[Stand, Element]]:
    out: dict[str, tuple[Stand, Element]] = {}
    for stand in stands:
        for element in there:
            if element.kind == stand.element and stand.needs <= element.traits:
                out.setdefault(element.node, (stand, element))
    return out
