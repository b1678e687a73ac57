"""Terms of physics, one file a family. Emulator, fit and diagnosis all use these and no others."""

from rtctl.plants.element import Element, Stand, element, stand
from rtctl.plants.physics import (
    contact,
    drive,
    drive_dynamics,
    friction,
    friction_direction,
    friction_load,
    geometry,
    guide,
    load,
    presliding,
    ripple,
    ripple_tape,
    sensor,
    structure,
    tape,
    timing,
    transmission,
)
from rtctl.plants.physics.place import Place, place
from rtctl.plants.physics.placement import by_kind, elements, having, met, nodes, standing
from rtctl.plants.physics.story import Draw, Needs, Phrase
from rtctl.plants.physics.term import Term

FAMILIES = (  # in the order in which they act: what asymmetry scales and presliding replaces must be there before, and
    # so must all that stretches, lets go or slackens a spring, before anything rubs by its tension
    timing, drive, drive_dynamics, ripple_tape, geometry, transmission, contact, structure, tape, friction,
    friction_load, load, friction_direction, presliding, ripple, guide, sensor,
)  # fmt: skip
TERMS: dict[str, Term] = {
    term.name: term for family in FAMILIES for term in vars(family).values() if isinstance(term, Term)
}

__all__ = [
    "TERMS", "Draw", "Element", "Needs", "Phrase", "Place", "Stand", "Term", "by_kind", "element", "elements", "having",
    "met", "nodes", "only", "ordered", "place", "stand", "standing",
]  # fmt: skip


def ordered(terms: list) -> list:
    """Entries of a `physics:` list in the order in which their terms act."""
    names = list(TERMS)
    return sorted(terms, key=lambda settings: names.index(settings.term))


def only(field: str, value: object = True) -> str:
    """Name of the first term of the library that has this value in a field of its own. Raises StopIteration."""
    return next(name for name, term in TERMS.items() if getattr(term, field) == value)
