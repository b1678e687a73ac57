"""Terms of physics: every module here except TOOLS holds one term or a family. Emulator, fit and diagnosis use them.

A term acts after the terms of a lower `order`. Dry friction precedes asymmetry, which scales it, and presliding, which
replaces it. Elongation, slip and slack of a spring precede friction that depends on its tension.
"""

from importlib import import_module
from pkgutil import iter_modules

from rtctl.plants.element import Element, Stand, element, stand
from rtctl.plants.physics.place import Place, place
from rtctl.plants.physics.placement import anywhere, by_kind, elements, having, nodes, standing
from rtctl.plants.physics.story import Draw, Needs, Phrase
from rtctl.plants.physics.term import Term

TOOLS = {"placement", "place", "portrait", "search", "story", "term"}  # modules that hold no term


def _library() -> dict[str, Term]:
    """Terms of all the modules beside this one, in the order in which they act."""
    found = []
    for module in sorted({info.name for info in iter_modules(__path__)} - TOOLS):
        found += [t for t in vars(import_module(f"{__name__}.{module}")).values() if isinstance(t, Term)]
    return {term.name: term for term in sorted(found, key=lambda term: term.order)}


TERMS = _library()

__all__ = [
    "TERMS", "Draw", "Element", "Needs", "Phrase", "Place", "Stand", "Term", "anywhere", "by_kind", "element",
    "elements", "having", "nodes", "only", "ordered", "place", "stand", "standing",
]  # fmt: skip


def ordered(terms: list) -> list:
    """Entries of a `physics:` list in the order in which their terms act."""
    names = list(TERMS)
    return sorted(terms, key=lambda settings: names.index(settings.term))


def only(field: str, value: object = True) -> str:
    """Name of the first term of the library that has this value in a field of its own. Raises StopIteration."""
    return next(name for name, term in TERMS.items() if getattr(term, field) == value)
