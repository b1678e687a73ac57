"""Checks of a description: an inconsistency is refused with its path and its remedy."""

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rtctl.config.errors import nearest
from rtctl.plants import linear
from rtctl.plants.graph.mechanics import bodies_of

if TYPE_CHECKING:
    from rtctl.plants.graph.description import Description

RESERVED = ("frame", "loop")
MOST = {
    "bodies": linear.MOST_BODIES, "joints": linear.MOST_LINKS, "drives": linear.MOST_DRIVES,
    "sensors": linear.MOST_SENSORS,
}  # fmt: skip


def check(machine: "Description") -> None:
    """Raise ValueError, which begins with a dotted path, where a description contradicts itself."""
    for group, most in MOST.items():
        names = list(getattr(machine, group))
        if len(names) > most:
            raise ValueError(f"{group}: {len(names)} are described; {most} is the most that one machine can have")
        for name in names:
            _check_name(group, name)
    if all(body.fixed for body in machine.bodies.values()):
        raise ValueError("bodies: every body is fixed; give one that moves its inertia or mass")
    for name, joint in machine.joints.items():
        _check_joint(machine, name, joint)
    _check_rigid(machine)
    _check_spans(machine)
    for group in ("drives", "sensors"):
        for name, element in getattr(machine, group).items():
            _check_place(machine, f"{group}.{name}", element)
    _check_columns(machine)
    _check_seen(machine)
    _check_symbols(machine)


def _check_name(group: str, name: str) -> None:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,39}", name):
        raise ValueError(f"{group}.{name}: a name is a letter and up to 39 letters, digits, - or _ after it")
    if name in RESERVED and not (group == "bodies" and name == "frame"):
        raise ValueError(f"{group}.{name}: '{name}' has a meaning of its own; take another name")


def _check_joint(machine: "Description", name: str, joint: Any) -> None:
    for end in ("from", "to"):
        _known(f"joints.{name}.{end}", getattr(joint, end), [*machine.bodies, "frame"], "body")
    a, b = getattr(joint, "from"), joint.to
    if a == b or (machine.is_frame(a) and machine.is_frame(b)):
        raise ValueError(f"joints.{name}.to: the joint connects {a} to itself; give the body at its other end")
    if joint.stiffness is None and (machine.is_frame(a) or machine.is_frame(b)):
        held = a if machine.is_frame(b) else b
        raise ValueError(
            f"joints.{name}.stiffness is missing: a rigid joint to the frame holds {held} still; give the stiffness, "
            f"or write bodies.{held}.fixed: true"
        )


def _check_spans(machine: "Description") -> None:
    """Check that a span has two radii, and that a reel ends a span and no rigid joint."""
    for name, joint in machine.joints.items():
        if joint.span is None:
            continue
        for end in ("from", "to"):
            body = machine.bodies.get(getattr(joint, end))
            if body is None or body.radius is None:
                raise ValueError(
                    f"joints.{name}.{end}: {getattr(joint, end)} has no radius for the tape to run on; give "
                    f"bodies.{getattr(joint, end)}.radius"
                )
    reels = [name for name, body in machine.bodies.items() if body.reel is not None]
    if len(reels) > linear.MOST_REELS:
        raise ValueError(f"bodies: {len(reels)} reels; {linear.MOST_REELS} is the most that one machine can have")
    for name in reels:
        body, joints = machine.bodies[name], _joints_at(machine, name)
        assert body.reel is not None and body.radius is not None and body.inertia is not None
        if body.radius < body.reel.core:
            raise ValueError(f"bodies.{name}.radius: {body.radius:g} m is less than the core of {body.reel.core:g} m")
        paper = 0.5 * math.pi * body.reel.density * body.reel.width * (body.radius**4 - body.reel.core**4)
        if body.inertia <= paper:
            raise ValueError(
                f"bodies.{name}.inertia: {body.inertia:g} kg m^2 is not more than the {paper:g} kg m^2 of its tape; "
                "give that of the reel with its tape"
            )
        if not any(machine.joints[held].span for held in joints):
            raise ValueError(f"bodies.{name}.reel: no span of tape ends here; give a joint with span: open or crossed")
        for held in joints:
            if machine.joints[held].stiffness is None:
                raise ValueError(
                    f"joints.{held}.stiffness is missing: {name} is a reel, whose inertia changes, and cannot move as "
                    "one with another body"
                )


def _joints_at(machine: "Description", body: str) -> list[str]:
    return [name for name, joint in machine.joints.items() if body in (getattr(joint, "from"), joint.to)]


def _check_rigid(machine: "Description") -> None:
    """Check that no rigid joint connects bodies that are rigidly connected already."""
    group = {name: name for name in machine.bodies}

    def root(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    for name, joint in machine.joints.items():
        if joint.stiffness is not None:
            continue
        a, b = root(getattr(joint, "from")), root(joint.to)
        if a == b:
            raise ValueError(
                f"joints.{name}.stiffness is missing: {getattr(joint, 'from')} and {joint.to} move as one already, "
                "so this closes a loop of rigid joints; give one joint of the loop a stiffness"
            )
        group[b] = a


def _check_place(machine: "Description", path: str, element: Any) -> None:
    for key, known in (("body", machine.bodies), ("joint", machine.joints), ("drive", machine.drives)):
        name = getattr(element, key, None)
        if name is None:
            continue
        _known(f"{path}.{key}", name, list(known), key)
        if key == "body" and machine.is_frame(name):
            raise ValueError(f"{path}.body: {name} is the frame, which does not move; give a body that does")
        if key == "joint" and machine.joints[name].stiffness is None:
            raise ValueError(
                f"{path}.joint: {name} is rigid, so its ends do not move against each other; give "
                f"joints.{name}.stiffness, or a body"
            )
    _check_through(machine, path, element)


def _check_through(machine: "Description", path: str, sensor: Any) -> None:
    """Check that a sensor looks through a span that ends at its body."""
    span = getattr(sensor, "through", None)
    if span is None:
        return
    at = [n for n, j in machine.joints.items() if j.span is not None and sensor.body in (getattr(j, "from"), j.to)]
    if not at:
        raise ValueError(f"{path}.through: no span of tape ends at {sensor.body}; leave it out, or describe the span")
    _known(f"{path}.through", span, at, f"span at {sensor.body}")
    other = next((n for n, s in machine.sensors.items() if s.through == span and not path.endswith(f".{n}")), None)
    if other is not None:
        raise ValueError(f"{path}.through: {other} looks through {span} already; one sensor can")


def _check_columns(machine: "Description") -> None:
    taken: dict[str, str] = {"t": "the clock", "ref": "the reference", "w": "the excitation"}
    for group in ("drives", "sensors"):
        for name, element in getattr(machine, group).items():
            if element.column in taken:
                raise ValueError(
                    f"{group}.{name}.column: '{element.column}' is {taken[element.column]} already; "
                    "each signal has a column of its own"
                )
            taken[element.column] = f"that of {group}.{name}"


def _check_seen(machine: "Description") -> None:
    """Check that every body is connected with a body that a sensor measures."""
    near: dict[str, set[str]] = {name: set() for name in machine.bodies}
    for joint in machine.joints.values():
        ends = [end for end in (getattr(joint, "from"), joint.to) if not machine.is_frame(end)]
        if len(ends) == 2:
            near[ends[0]].add(ends[1])
            near[ends[1]].add(ends[0])
    moved = [name for name in bodies_of(machine) if name in near]
    for name in moved:
        near[name] |= set(moved) - {name}
    reached: set[str] = set()
    todo = list(_looked_at(machine))
    while todo:
        name = todo.pop()
        if name not in reached:
            reached.add(name)
            todo += near[name]
    for name in machine.bodies:
        if name not in reached and not machine.is_frame(name):
            raise ValueError(
                f"bodies.{name}: no sensor sees it, nor any body that it is connected with; add a sensor or a joint, "
                "or leave the body out"
            )


def _check_symbols(machine: "Description") -> None:
    """Check that every symbol refers to numbers of the description."""
    known = [path for path, _ in machine.paths()]
    for symbol, paths in machine.symbols.items():
        for path in paths:
            _known(f"symbols.{symbol}", path, known, "number")


def _looked_at(machine: "Description") -> Iterator[str]:
    for sensor in machine.sensors.values():
        drive = machine.drives[sensor.drive] if sensor.drive is not None else sensor
        if drive.body is not None:
            yield drive.body
        elif drive.joint is not None:
            joint = machine.joints[drive.joint]
            yield from (end for end in (getattr(joint, "from"), joint.to) if not machine.is_frame(end))


def _known(path: str, name: str, known: list[str], what: str) -> None:
    if name not in known:
        near = nearest(name, known)
        hint = f"did you mean '{near}'?" if near else f"there are {', '.join(known) or 'none'}"
        raise ValueError(f"{path}: there is no {what} '{name}'; {hint}")
