"""First state of a described machine: dotted paths of the values that each recording has for itself."""

from rtctl.plants.graph.coupled import felt
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import NOWHERE, Layout

START = "start.angle"  # e to the angle, rad, by which the zero of a position is off before the weight of a body
FIRST_POSITION, FIRST_SPEED = "start.position", "start.speed"  # of a free response, as START, in units of the record
OWN_START = "start.bodies."  # head of the first position and speed of a body that a spring joins to the others
BEGINS = "start"  # start.BODY: the same of each body of mechanics from a file, whose position its motion depends on
HELD_PROBLEMS = ("static", "kinematic")  # the main sensor's motion is given


def is_start(path: str) -> bool:
    """Whether a path is of the state at the first row, which each recording has for itself."""
    return path.startswith("start.")


def zeros(machine: Description, placed: Layout, values: dict[str, float]) -> list[str]:
    """Paths of the angles by which the zero of a position may be off, where the motion depends on that zero."""
    out = []
    angles = any(s.measures == "position" for s in machine.sensors.values())
    if angles and any(w.incline is None for body in machine.bodies.values() for w in body.weights):
        out.append(START)
    for name in felt(placed, values):
        if any(s.body == name and s.measures == "position" for s in machine.sensors.values()):
            out.append(f"{BEGINS}.{name}")
    return out


def first_states(machine: Description, placed: Layout, problem: str) -> list[str]:
    """Paths of first positions and speeds that are unknown in a problem, those of the followed sensor first.

    The tracking correction sets the followed coordinate, but for a free response, which nothing tracks. A machine that
    rings as the recording begins is not at rest.
    """
    out = [FIRST_POSITION, FIRST_SPEED] if problem == "free" else []
    if problem in HELD_PROBLEMS or not placed.links:
        return out
    followed = [
        s.body for kind in ("position", "speed") for s in machine.sensors.values() if s.measures == kind and s.body
    ]
    taken = {NOWHERE, *(placed.bodies[str(body)].coordinate for body in followed[:1])}
    for name, body in placed.bodies.items():
        if body.coordinate not in taken:
            taken.add(body.coordinate)
            out += [f"{OWN_START}{name}.position", f"{OWN_START}{name}.speed"]
    return out
