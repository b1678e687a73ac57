"""Nodes of a described machine: where a term of physics may stand, and the numbers of that place in the record."""

from typing import NamedTuple

from rtctl.config.errors import nearest
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import Layout
from rtctl.plants.graph.params import place as element_place

LOOP = "loop"
BODY, JOINT, DRIVE, SENSOR = "body", "joint", "drive", "sensor"
FAMILIES = {  # kind of element -> beginnings of the names of terms that act there
    BODY: ("friction.", "load.", "ripple.cogging", "structure.resonance"),
    JOINT: ("transmission.", "structure.stiffening"),
    DRIVE: ("drive.",),
    SENSOR: ("sensor.", "ripple.encoder"),
    LOOP: ("timing.delay",),
}


class Spot(NamedTuple):
    """Numbers of a node in the machine's record; what the node does not have is 0."""

    node: int  # coordinate
    link: int
    channel: int  # of the drive or the sensor
    ratio: float  # what the node moves for one unit of its coordinate


def kind_of(machine: Description, node: str) -> str | None:
    """Kind of the element with this name: body, joint, drive, sensor or loop; None where there is none."""
    if node == LOOP:
        return LOOP
    for kind, group in (
        (BODY, machine.bodies), (JOINT, machine.joints), (DRIVE, machine.drives), (SENSOR, machine.sensors),
    ):  # fmt: skip
        if node in group:
            return kind
    return None


def nodes_for(machine: Description, term: str) -> list[str]:
    """Names of the elements at which a term may stand."""
    bodies = [name for name in machine.bodies if not machine.is_frame(name)]
    springs = [name for name, joint in machine.joints.items() if joint.stiffness is not None]
    groups = {BODY: bodies, JOINT: springs, DRIVE: list(machine.drives), SENSOR: list(machine.sensors), LOOP: [LOOP]}
    own = ":" in term  # of a file of the user's own: wherever they put it
    return [name for kind, begins in FAMILIES.items() if own or term.startswith(begins) for name in groups[kind]]


def check_node(machine: Description, path: str, term: str, node: str) -> None:
    """Raise ValueError, which begins with `path`, where a term cannot stand at a node."""
    allowed = nodes_for(machine, term)
    if node not in allowed:
        near = nearest(node, allowed)
        hint = (
            f"did you mean '{near}'?" if near else f"it can stand at {', '.join(allowed) or 'no node of this machine'}"
        )
        raise ValueError(f"{path}: {term} cannot stand at '{node}'; {hint}")


def place_of(layout: Layout, values: dict[str, float], node: str) -> Spot:
    """Place of a node; of a drive or a sensor the coordinate that it acts on, of a body the first spring at it."""
    machine = layout.machine
    kind = kind_of(machine, node)
    if kind == BODY:
        springs = (
            n
            for name, n in layout.links.items()
            if node in (getattr(machine.joints[name], "from"), machine.joints[name].to)
        )
        return Spot(layout.coordinate(node), next(springs, 0), 0, layout.ratio(node, values))
    if kind == JOINT:
        return Spot(layout.coordinate(machine.joints[node].to), layout.links.get(node, 0), 0, 1.0)
    if kind == DRIVE:
        i, a, _, _ = element_place(layout, machine.drives[node], values)
        return Spot(i, 0, layout.drives[node], a)
    if kind == SENSOR:
        sensor = machine.sensors[node]
        if sensor.drive is not None:
            return Spot(0, 0, layout.sensors[node], 1.0)
        i, a, _, _ = element_place(layout, sensor, values)
        return Spot(i, 0, layout.sensors[node], a)
    return Spot(0, 0, 0, 1.0)
