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

BY_LINK = frozenset({"loaded", "reel", "capstan", "wheel"})  # traits of a body on which a certain link acts


class Spot(NamedTuple):
    """Where a term acts in the machine's record; NOWHERE for a link or a channel that it does not have."""

    node: int  # coordinate
    link: int
    channel: int  # of the drive or the sensor
    factor: float  # motion of the node for one unit of the coordinate
    other: int = NOWHERE  # link on the other side of the body that the tape of `link` lies around


def elements(layout: Layout) -> tuple[Element, ...]:
    """Every element of a described machine, in the order of the description."""
    machine = layout.machine
    driven = driven_bodies(machine)
    rubs = {found for drive in machine.drives.values() if (found := rubbing(machine, drive)) is not None}
    moving = [name for name in machine.bodies if layout.bodies[name].coordinate != NOWHERE]
    sprung = {end for name, joint in machine.joints.items() if name in layout.links for end in ends_of(joint)}
    coupled = bodies_of(machine)
    touching = contacts(machine)
    rims = {getattr(machine.joints[c.joint], "from") for c in touching.values() if c.joint in layout.links}
    lone = len(moving) == 1 and len(machine.sensors) == 1
    out: list[Element] = []
    for name in moving:
        body = machine.bodies[name]
        traits = ["general", "turns rotor" if body.turns else "slides", "bounded"]
        traits += ["driven" if name in driven else "load"]
        traits += [] if name in coupled else ["single"]
        traits += ["dry"] if body.dry > 0.0 else []
        traits += ["rubs"] if name in rubs else []
        traits += ["sprung"] if name in sprung else []
        traits += ["heavy"] if any(weight.incline is None for weight in body.weights) else []
        winds = body.reel is not None and any(machine.joints[span].to == name for span in spans(machine, name))
        traits += ["reel"] if winds else []
        pushed = name in driven and not {"sprung", "heavy"} & set(traits)  # by its drive alone
        traits += ["loaded"] if winds or name in touching or pushed else []
        traits += ["wheel"] if name in rims else []
        traits += ["capstan"] if name in touching and name not in rims else []
        traits += ["wrapped"] if name in touching and not touching[name].joint else []
        traits += ["guided"] if _rolls(machine, name) and _sensor_of(layout, name) != NOWHERE else []
        out.append(element(name, "body", " ".join(traits)))
    for name, joint in machine.joints.items():
        traits = ["general", "rigid"] if joint.stiffness is None else ["general", "spring"]
        if joint.stiffness is not None:
            traits += ["span" if joint.span is not None else "shaft"]
            traits += ["path"] if _seen_through(machine, name) is not None else []
            traits += ["ground"] if any(machine.is_frame(end) for end in ends_of(joint)) else []
        traits += ["turning"] if machine.turns(getattr(joint, "from")) else []
        traits += ["turned"] if machine.turns(joint.to) else []
        out.append(element(name, "joint", " ".join(traits)))
    for name, contact in touching.items():
        spring = contact.joint in layout.links
        what = "contact span" if not contact.joint else "contact spring shaft" if spring else "contact rigid"
        out.append(element(name, "joint", what))
    for number, (name, drive) in enumerate(machine.drives.items()):
        traits = ["general", drive.kind, *(["supply"] if number == 0 else [])]
        traits += ["several"] if len(machine.drives) > 1 else []
        out.append(element(name, "drive", " ".join(traits)))
    for name, sensor in machine.sensors.items():
        if sensor.body is None or sensor.measures not in ("position", "speed"):
            continue
        turns = machine.turns(sensor.body)
        traits = ["general", sensor.measures if sensor.direction else "edges", "turns" if turns else "slides"]
        traits += ["driven" if sensor.body in driven else "load"]
        traits += ["counts"] if sensor.counts_per_unit is not None else []
        traits += ["guided"] if _rolls(machine, sensor.body) or (lone and not turns) else []
        traits += ["lone"] if lone else []
        out.append(element(name, "sensor", " ".join(traits)))
    return (*out, LOOP)


class Contact(NamedTuple):
    """Friction contact at a body: the joint that the body drives, or the spans that lie around it."""

    joint: str  # "" where spans lie around it
    spans: tuple[str, ...]


def contacts(machine: Description) -> dict[str, Contact]:
    """Contacts by body: the body whose rim drives, or the body that tape lies around."""
    out = {getattr(joint, "from"): Contact(name, ()) for name, joint in machine.joints.items() if joint.contact}
    for name, body in machine.bodies.items():
        around = spans(machine, name)
        if body.reel is None and len(around) == 2:
            out.setdefault(name, Contact("", around))
    return out


def spans(machine: Description, body: str) -> tuple[str, ...]:
    """Joints of tape that end at a body."""
    return tuple(n for n, joint in machine.joints.items() if joint.span is not None and body in ends_of(joint))


def ends_of(joint: Any) -> tuple[str, str]:
    """Names of the two ends of a joint."""
    return getattr(joint, "from"), joint.to


def driven_bodies(machine: Description) -> set[str]:
    """Bodies on which a drive acts."""
    out = {str(drive.body) for drive in machine.drives.values() if drive.body is not None}
    for drive in machine.drives.values():
        if drive.joint is not None:
            out |= set(ends_of(machine.joints[drive.joint]))
    return out


def rubbing(machine: Description, drive: Any) -> str | None:
    """The body with dry friction that is nearest to a drive; None where no body has dry friction."""
    todo = [drive.body] if drive.body is not None else list(ends_of(machine.joints[drive.joint]))
    seen = set(todo)
    while todo:
        here = todo.pop(0)
        if not machine.is_frame(here) and machine.bodies[here].dry > 0.0:
            return str(here)
        for joint in machine.joints.values():
            if here in ends_of(joint):
                new = [end for end in ends_of(joint) if end not in seen and not machine.is_frame(end)]
                todo += new
                seen |= set(new)
    return None


def undriven(machine: Description, joint: str) -> set[str]:
    """Bodies on the side of a joint that drives move only through the joint; both sides where each has a drive."""
    driven, sides = driven_bodies(machine), []
    for end in ends_of(machine.joints[joint]):
        side, todo = {end}, [end]
        while todo:
            here = todo.pop()
            for name, other in machine.joints.items():
                if name != joint and here in ends_of(other):
                    new = [e for e in ends_of(other) if e not in side and not machine.is_frame(e)]
                    side |= set(new)
                    todo += new
        sides.append(side)
    return next((side for side in sides if not side & driven), sides[0] | sides[1])


def _rolls(machine: Description, body: str) -> bool:
    """Whether a body runs along a strip on which a contact rolls."""
    return not machine.turns(body) and any(joint.contact and joint.to == body for joint in machine.joints.values())


def _sensor_of(layout: Layout, body: str) -> int:
    """Channel of the first sensor of a body's position."""
    for name, sensor in layout.machine.sensors.items():
        if sensor.body == body and sensor.measures == "position":
            return layout.sensors[name]
    return NOWHERE


def _presses(layout: Layout, body: str) -> tuple[int, int]:
    """Links that press on a body's bearing: the spans at the body (for a reel also the span on the other side of the
    body that its tape lies around), else the first spring that ends at the body and not at the frame."""
    machine = layout.machine
    around = spans(machine, body)
    if around:
        first = layout.links[around[0]]
        return first, layout.links[around[1]] if len(around) > 1 else _beside(layout, around[0])
    for name, link in layout.links.items():
        two = ends_of(machine.joints[name])
        if body in two and not any(machine.is_frame(end) for end in two):
            return link, NOWHERE
    return NOWHERE, NOWHERE


def _beside(layout: Layout, span: str) -> int:
    """Link on the other side of the body that a span lies around."""
    for contact in contacts(layout.machine).values():
        if span in contact.spans:
            return layout.links[next(other for other in contact.spans if other != span)]
    return NOWHERE


def _seen_through(machine: Description, span: str) -> str | None:
    """Sensor that looks through a span; None where none does."""
    return next((name for name, sensor in machine.sensors.items() if sensor.through == span), None)


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
    element, machine = found[1], layout.machine
    kind = element.kind
    if kind == "body":
        contact, (link, other) = contacts(machine).get(node), (NOWHERE, NOWHERE)
        if found[0].needs & BY_LINK:
            link, other = _presses(layout, node)
        moved = machine.joints[contact.joint].to if contact is not None and contact.joint else node
        reads = any(site.partition(":")[0] == "reading" for site in term.act)
        channel = _sensor_of(layout, moved) if reads and not machine.turns(moved) else NOWHERE
        return Spot(layout.coordinate(node), link, channel, layout.ratio(node, values), other)
    if "contact" in element.traits:
        return _contact(contacts(machine)[node], node, layout, values)
    if kind == "joint":
        end = getattr(machine.joints[node], getattr(settings, "end", "to"))
        other = _beside(layout, node) if "span" in found[0].needs else NOWHERE
        eye = _seen_through(machine, node) if "path" in found[0].needs else None
        if eye is not None:
            body = str(machine.sensors[eye].body)
            at = layout.links[node]
            return Spot(layout.coordinate(body), at, layout.sensors[eye], layout.ratio(body, values), other)
        return Spot(layout.coordinate(end), layout.links.get(node, NOWHERE), 0, layout.ratio(end, values), other)
    if kind == "drive":
        i, a, _, _ = place(layout, machine.drives[node], values)
        return Spot(i, NOWHERE, layout.drives[node], a)
    if kind == "sensor":
        i, a, _, _ = place(layout, machine.sensors[node], values)
        return Spot(i, NOWHERE, layout.sensors[node], a)
    return Spot(0, NOWHERE, 0, 1.0)


def _contact(contact: Contact, node: str, layout: Layout, values: dict[str, float]) -> Spot:
    """Where a contact at a body slides."""
    i, own = layout.coordinate(node), layout.ratio(node, values)
    if not contact.joint:
        one, two = (layout.links[name] for name in contact.spans)
        return Spot(i, one, NOWHERE, own, two)
    moved = layout.machine.joints[contact.joint].to
    if contact.joint in layout.links:
        return Spot(i, layout.links[contact.joint], NOWHERE, own)
    return Spot(i, NOWHERE, _sensor_of(layout, moved), layout.ratio(moved, values))
