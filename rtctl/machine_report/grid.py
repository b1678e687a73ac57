"""Places of bodies in a drawing: the column is the number of joints from a driven body, the row is the branch."""

from typing import NamedTuple

from rtctl.plants.graph.description import FRAME, Description
from rtctl.plants.graph.mechanics import bodies_of, code_of


class Grid(NamedTuple):
    """Column and row of every body, and of the frame where a joint ends at it."""

    places: dict[str, tuple[int, int]]
    columns: int
    rows: int


def grid(machine: Description) -> Grid:
    """Places of the bodies; an unconnected body begins a row of its own."""
    near: dict[str, list[str]] = {name: [] for name in machine.bodies}
    if any(FRAME in ends(joint) for joint in machine.joints.values()):
        near.setdefault(FRAME, [])
    for joint in machine.joints.values():
        a, b = ends(joint)
        near[a].append(b)
        near[b].append(a)
    driven = [drive.body for drive in machine.drives.values() if drive.body is not None]
    places: dict[str, tuple[int, int]] = {}
    used: dict[int, int] = {}

    def put(name: str, column: int) -> None:
        places[name] = column, used.get(column, 0)
        used[column] = used.get(column, 0) + 1

    for first in [*driven, *near]:
        if first in places:
            continue
        column = min((c for c, _ in places.values()), default=0) if first in driven else max(used, default=-1) + 1
        put(first, column if first in driven else 0 if not near[first] else column)
        todo = [first]
        while todo:
            here = todo.pop(0)
            for other in near[here]:
                if other not in places and other not in driven:
                    put(other, places[here][0] + 1)
                    todo.append(other)
    return Grid(places, max(used) + 1, max(used.values()))


def ends(joint: object) -> tuple[str, str]:
    """Names of the two ends of a joint."""
    return getattr(joint, "from"), getattr(joint, "to")  # noqa: B009  `from` is a word of Python


def above(machine: Description, name: str) -> list[str]:
    """Texts of the drives of a body: name, column, and sensors of the drive."""
    return [_drive(machine, n) for n, d in machine.drives.items() if d.body == name]


def _drive(machine: Description, name: str) -> str:
    seen = [f", {n} ({s.measures})" for n, s in machine.sensors.items() if s.drive == name]
    return f"{name} ({machine.drives[name].column}){''.join(seen)}"


def below(machine: Description, name: str) -> list[str]:
    """Texts of the sensors of a body: name and measured quantity."""
    return [f"{n} ({s.measures})" for n, s in machine.sensors.items() if s.body == name]


def on_joint(machine: Description, name: str) -> list[str]:
    """Texts of the drives and sensors of a joint."""
    drives = [_drive(machine, n) for n, d in machine.drives.items() if d.joint == name]
    return drives + [f"{n} ({s.measures})" for n, s in machine.sensors.items() if s.joint == name]


def marks(machine: Description, name: str) -> str:
    """Text with the properties of a body beside its inertia: weight, friction, a mechanics file."""
    body = machine.bodies.get(name)
    if body is None or machine.is_frame(name):
        return ""
    words = (["weight"] if body.weights else []) + (["friction"] if body.dry or body.viscous else [])
    code = code_of(machine)
    words += [f"moved by {code.name}"] if code is not None and name in bodies_of(machine) else []
    return ", ".join(words)
