"""Other forms of a hypothesis: richer ones, those that differ by a setting, and the same law by another name.

A search begins with the plain form. Once that stands, the record is asked for harmonics, for a second branch, for
another shape of the same physics; and where two names of the library are one law, for the other name.
"""

from rtctl.diagnose.model.space import Hypothesis
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.search import Choice


def is_rich(h: Hypothesis) -> bool:
    """Whether it has its richer form already."""
    more = {part[0] for part in TERMS[h.term].richer if not isinstance(part, Choice)}
    return any(c.name.partition("|")[0] in more for c in h.coordinates)


def forms(h: Hypothesis) -> list[Hypothesis]:
    """The same hypothesis in each of its other forms."""
    term = TERMS[h.term]
    if term.variants is None:
        return []
    name, values, _ = term.variants
    default = term.settings.model_fields[name].default
    return [h._replace(fixed={**h.fixed, name: v}) for v in values if v != h.fixed.get(name, default)]
