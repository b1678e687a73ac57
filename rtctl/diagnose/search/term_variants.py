"""Other forms of a hypothesis: with more parameters, or with another setting.

A search begins with the plain form. Once the plain form is accepted, the search tries harmonics, a second branch, and
another shape of the same physics.
"""

from rtctl.diagnose.model.space import Hypothesis
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.search import Choice


def is_rich(h: Hypothesis) -> bool:
    """Whether a hypothesis has its richer form already."""
    more = {part[0] for part in TERMS[h.term].richer if not isinstance(part, Choice)}
    return any(c.name.partition("|")[0] in more for c in h.coordinates)


def forms(h: Hypothesis) -> list[Hypothesis]:
    """Hypotheses with each other value of the variant setting of the term."""
    term = TERMS[h.term]
    if term.variants is None:
        return []
    name, values, _ = term.variants
    default = term.settings.model_fields[name].default
    return [h._replace(fixed={**h.fixed, name: v}) for v in values if v != h.fixed.get(name, default)]
