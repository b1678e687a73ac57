"""Places of a described machine where a term of physics may stand."""

from typing import NamedTuple

from rtctl.plants.graph.layout import NOWHERE, Layout
from rtctl.plants.graph.params import joint_place, place
from rtctl.plants.physics.term import Term

LOOP = "loop"
WHERE = {  # kind of element at which a term of this name or family stands
    "friction.": ("body",), "load.": ("body",), "transmission.": ("joint",), "structure.stiffening": ("joint",),
    "structure.resonance": ("body",), "ripple.cogging": ("body",), "ripple.encoder": ("sensor",), "drive.": ("drive",),
    "timing.delay": ("loop",), "sensor.": ("sensor",),
}  # fmt: skip
LEFT_OUT = (
    "friction.load", "load.cable_chain", "transmission.slip", "transmission.creep", "sensor.missed_counts",
    "drive.thermal",
)  # fmt: skip


class Place(NamedTuple):
    """Where a term acts in the machine's record."""

    node: int  # coordinate
    link: int
    channel: int  # of the drive or the sensor
    factor: float  # what the node moves for one unit of the coordinate


def stands(term: Term) -> tuple[str, ...]:
    """Kinds of element at which a term may stand; empty for none."""
    if term.name in LEFT_OUT:
        return ()
    return next((kinds for name, kinds in WHERE.items() if term.name.startswith(name)), ())


def nodes(term: Term, layout: Layout) -> list[str]:
    """Names of the elements of a machine at which a term may stand."""
    out: list[str] = []
    for kind in stands(term):
        if kind == "body":
            out += [name for name, body in layout.bodies.items() if body.coordinate != NOWHERE]
        elif kind == "joint":
            out += list(layout.links)
        elif kind == "drive":
            out += list(layout.drives)
        elif kind == "sensor":
            out += list(layout.sensors)
        else:
            out.append(LOOP)
    return out


def find(term: Term, node: str, layout: Layout, values: dict[str, float]) -> Place:
    """Place of a term at a node."""
    for kind in stands(term):
        if kind == "body" and node in layout.bodies:
            return Place(layout.coordinate(node), 0, 0, layout.ratio(node, values))
        if kind == "joint" and node in layout.links:
            i, a, _, _ = joint_place(layout, node, values)
            return Place(i, layout.links[node], 0, a)
        if kind == "drive" and node in layout.drives:
            i, a, _, _ = place(layout, layout.machine.drives[node], values)
            return Place(i, 0, layout.drives[node], a)
        if kind == "sensor" and node in layout.sensors:
            sensor = layout.machine.sensors[node]
            if sensor.drive is not None:
                return Place(0, 0, layout.sensors[node], 1.0)
            i, a, _, _ = place(layout, sensor, values)
            return Place(i, 0, layout.sensors[node], a)
    return Place(0, 0, 0, 1.0)
