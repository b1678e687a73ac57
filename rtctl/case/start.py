"""Initial state of a described machine: dotted paths of values that differ between recordings."""

from rtctl.plants.graph.coupled import felt
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import NOWHERE, Layout

START = "start.angle"  # exp of the zero offset of an angle, rad, where the weight of a body acts
FIRST_POSITION, FIRST_SPEED = "start.position", "start.speed"  # exp of a free response's first values, in its units
OWN_START = "start.bodies."  # prefix of the first position and speed of a body that a spring joins to the others
BEGINS = "start"  # start.BODY: exp of the zero offset of a body in a mechanics file, if its position affects the motion
HELD_PROBLEMS = ("static", "kinematic")  # problems in which the main sensor's motion is given


def is_start(path: str) -> bool:
    """Whether a path belongs to the initial state, which differs between recordings."""
    return path.startswith("start.")


def zeros(machine: Description, placed: Layout, values: dict[str, float]) -> list[str]:
    """Paths of the zero offsets of positions, where the motion depends on the zero."""
    out = []
    angles = any(s.measures == "position" for s in machine.sensors.values())
    if angles and any(w.incline is None for body in machine.bodies.values() for w in body.weights):
        out.append(START)
    for name in felt(placed, values):
        if any(s.body == name and s.measures == "position" for s in machine.sensors.values()):
            out.append(f"{BEGINS}.{name}")
    return out


def first_states(machine: Description, placed: Layout, problem: str) -> list[str]:
    """Paths of unknown initial positions and speeds in a problem, those of the followed sensor first.

    The tracking correction sets the followed coordinate, except in a free response, which has no tracking. A machine
    may oscillate at the start of the recording.
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
