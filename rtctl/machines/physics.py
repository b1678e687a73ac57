"""The `physics:` list of a plant's config: any term of the library at any node where it can stand."""

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from rtctl.config.errors import nearest
from rtctl.plants.physics import TERMS, nodes

if TYPE_CHECKING:
    PhysicsTerm = Any
else:
    PhysicsTerm = Annotated[reduce(or_, [term.settings for term in TERMS.values()]), Field(discriminator="term")]


def check_nodes(terms: list[Any], kind: str) -> None:
    """Raise ValueError where a term stands at a node that the plant lacks or that does not suit the term."""
    for i, settings in enumerate(terms):
        allowed = nodes(TERMS[settings.term], kind)
        if settings.node not in allowed:
            near = nearest(settings.node, allowed)
            hint = (
                f"did you mean '{near}'?"
                if near
                else f"it can stand at {', '.join(allowed) or 'no node of this plant'}"
            )
            raise ValueError(
                f"physics.{i}.node: {settings.term} cannot stand at '{settings.node}' of the {kind}; {hint}"
            )
