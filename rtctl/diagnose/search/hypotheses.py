"""Hypotheses of a recording: each term of the library at each element of the machine to which it applies."""

from collections.abc import Sequence

import numpy as np

from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.model.space import Hypothesis
from rtctl.diagnose.search.grid_starts import parts_of, searched, shows_alone, starts_of
from rtctl.idiom import Settings
from rtctl.plants.element import Element
from rtctl.plants.physics import TERMS, Term, nodes, standing
from rtctl.plants.physics.search import Hint

SLIGHT = 0.01  # share of the force that moves a node: least friction for a term that needs friction
ONE_SIGN = 0.02  # share of the largest reading: least negative reading that counts as the other sign
BY_TURN = ("order", "order_from", "order_to")  # kinds of hints that need half a period of an order, not whole turns
ABOUT = {  # kinds of element by problem: positions show no force, a measured force shows no command
    "kinematic": ("joint", "sensor"),
    "static": ("body", "joint", "sensor"),
}


def hypotheses(
    sim: Simulator, model: GraphModel, hints: dict[str, list] | None = None, beside: Sequence[Settings] = ()
) -> list[Hypothesis]:
    """Hypotheses of a machine, one for each start."""
    there = sim.elements
    measures = Measures(sim, model.base, hints or {})
    known = set(sim.kernel.names)
    dry_too = {str(getattr(s, "node", "")) for s in beside if TERMS[str(getattr(s, "term", ""))].friction == "dry"}
    out: list[Hypothesis] = []
    for name, term in TERMS.items():
        if not (name in known or term.joint) or not searched(name):
            continue
        for node in nodes(term, there):
            found = standing(term, there, node)
            assert found is not None
            stand, element = found
            if element.kind not in ABOUT.get(sim.case.problem, (element.kind,)):
                continue
            slides, unsigned = "slides" in element.traits, "speed" in element.traits and never_negative(sim, node)
            moved, slight = measures.scale(node), SLIGHT * measures.of("force", node)
            rubs = measures.dry(node) > slight or node in dry_too
            drags = measures.thick(node) * moved.speed > slight
            if (
                stand.again
                or not stand.offered
                or not term.in_format(sim.case.format)
                or (sim.case.plant and node not in nodes(term, sim.case.plant))
                or ("contact" in element.traits and "contact" not in stand.needs)
                or (term.needs.compared and len(sim.channels) < 2 and not shows_alone(term, element, slides, unsigned))
                or ((term.falls_to or term.replaces or term.needs.dry) and not rubs)
                or (term.needs.friction and not (rubs or drags))
                or (term.needs.both_ways and not measures.both_ways(node))
                or called_otherwise(sim, term, element, moved.span)
            ):
                continue
            turned = "turns" not in element.traits or moved.span >= 2 * np.pi * term.needs.turns
            for parts in stand.ways or ((term.sliding if slides else ()) or parts_of(name),):
                if turned or any(isinstance(part, Hint) and part.kind in BY_TURN for part in parts):
                    out += starts_of(name, node, parts, measures)
    return out


def called_otherwise(sim: Simulator, term: Term, element: Element, span: float) -> bool:
    """Whether the law of a term has another name at an element that moves over `span`.

    The law of an element that turns has one name for whole turns and another for less than a turn.
    """
    if "turns" not in element.traits:
        return False
    if span >= 2 * np.pi:
        return bool(term.round) and element.node in nodes(TERMS[term.round], sim.elements)
    others = (t for t in TERMS.values() if t.round == term.name and t.in_format(sim.case.format))
    return any(element.node in nodes(other, sim.elements) for other in others)


def never_negative(sim: Simulator, sensor: str) -> bool:
    """Whether a sensor shows one sign, except for its offset at rest."""
    y = sim.record.y.get(sensor, np.zeros(0))
    return bool(y.size and y.min() >= -ONE_SIGN * y.max())
