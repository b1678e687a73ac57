"""Elements of a described machine with the traits that its topology gives them, and where each acts in the record."""

from typing import Any, NamedTuple

from rtctl.config.errors import nearest
from rtctl.plants.element import LOOP, Element, element
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import NOWHERE, Layout
from rtctl.plants.graph.layout import layout as layout_of
from rtctl.plants.graph.mechanics import bodies_of
from rtctl.plants.graph.params import place
from rtctl.plants.physics import TERMS, Term, nodes, standing


class Spot(NamedTuple):
    """Where a term acts in the machine's record."""

    node: int  # coordinate
    link: int
    channel: int  # of the drive or the sensor
    factor: float  # what the node moves for one unit of the coordinate


def elements(layout: Layout) -> tuple[Element, ...]:
    """Every element of a described machine, in the order of the description."""
    machine = layout.machine
    driven = {drive.body for drive in machine.drives.values()}
    for drive in machine.drives.values():
        if drive.joint is not None:
            driven |= {getattr(machine.joints[drive.joint], "from"), machine.joints[drive.joint].to}
    springs = [joint for joint in machine.joints.values() if joint.stiffness is not None]
    sprung = {end for joint in springs for end in (getattr(joint, "from"), joint.to)}
    coupled = bodies_of(machine)
    out: list[Element] = []
    for name, body in machine.bodies.items():
        if layout.bodies[name].coordinate != NOWHERE:
            traits = ["general", "turns rotor" if body.turns else "slides", "bounded"]
            traits += ["driven" if name in driven else "load"]
            traits += [] if name in coupled else ["single"]
            traits += ["dry"] if body.dry > 0.0 else []
            traits += ["sprung"] if name in sprung else []
            traits += ["heavy"] if any(weight.incline is None for weight in body.weights) else []
            out.append(element(name, "body", " ".join(traits)))
    for name, joint in machine.joints.items():
        traits = ["general rigid" if joint.stiffness is None else "general spring shaft"]
        traits += ["turning"] if machine.turns(getattr(joint, "from")) else []
        traits += ["turned"] if machine.turns(joint.to) else []
        out.append(element(name, "joint", " ".join(traits)))
    for number, (name, drive) in enumerate(machine.drives.items()):
        traits = ["general", drive.kind, *(["supply"] if number == 0 else [])]
        traits += ["several"] if len(machine.drives) > 1 else []
        out.append(element(name, "drive", " ".join(traits)))
    for name, sensor in machine.sensors.items():
        if sensor.body is None or sensor.measures not in ("position", "speed"):
            continue
        traits = ["general", sensor.measures, "turns" if machine.turns(sensor.body) else "slides"]
        traits += ["driven" if sensor.body in driven else "load"]
        traits += ["counts"] if sensor.counts_per_unit is not None else []
        out.append(element(name, "sensor", " ".join(traits)))
    return (*out, LOOP)


def check_node(machine: Description, path: str, term: str, node: str) -> None:
    """Raise ValueError, which begins with `path`, where a term cannot stand at a node."""
    allowed = nodes(TERMS[term], elements(layout_of(machine)))
    if node not in allowed:
        near = nearest(node, allowed)
        hint = (
            f"did you mean '{near}'?" if near else f"it can stand at {', '.join(allowed) or 'no node of this machine'}"
        )
        raise ValueError(f"{path}: {term} cannot stand at '{node}'; {hint}")


def place_of(layout: Layout, values: dict[str, float], settings: Any) -> Spot:
    """Where an entry of a `physics:` list acts."""
    return spot(TERMS[settings.term], settings, layout, elements(layout), values)


def spot(term: Term, settings: Any, layout: Layout, there: tuple[Element, ...], values: dict[str, float]) -> Spot:
    """Where a term acts at its node: in a joint as its far end moves, or the end that its settings name. Raises
    ValueError where it cannot stand there."""
    node = settings.node
    found = standing(term, there, node)
    if found is None:
        raise ValueError(f"{term.name} cannot stand at '{node}'")
    kind, machine = found[1].kind, layout.machine
    if kind == "body":
        return Spot(layout.coordinate(node), 0, 0, layout.ratio(node, values))
    if kind == "joint":
        end = getattr(machine.joints[node], getattr(settings, "end", "to"))
        return Spot(layout.coordinate(end), layout.links.get(node, 0), 0, layout.ratio(end, values))
    if kind == "drive":
        i, a, _, _ = place(layout, machine.drives[node], values)
        return Spot(i, 0, layout.drives[node], a)
    if kind == "sensor":
        i, a, _, _ = place(layout, machine.sensors[node], values)
        return Spot(i, 0, layout.sensors[node], a)
    return Spot(0, 0, 0, 1.0)
