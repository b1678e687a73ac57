"""Elements of a machine and their traits, by which an effect selects its nodes.

A machine is a list of elements; effects, drives and reports refer to an element by the name of its node. One node may
name several elements: a motor and the shaft behind it, a wheel and the contact that drives it. Traits are physical
properties of an element and do not depend on the machine.
"""

from typing import Any, NamedTuple

TRAITS: dict[str, dict[str, str]] = {  # kind of element -> trait -> its meaning
    "body": {
        "turns": "turns, or is moved by something that turns, as a slide by a screw",
        "slides": "slides; with `turns` it is one of the two, as the units of the machine say",
        "driven": "a drive acts on it",
        "load": "no drive acts on it",
        "dry": "the description gives it dry friction",
        "rubs": "has the dry friction that a drive works against",
        "rotor": "has a mass that may be off centre",
        "loaded": "the force in a joint that ends at it presses on its bearing, or the load that it carries does",
        "wrapped": "tape lies around it, whose two tensions add up in its bearing",
        "bounded": "its way has two ends",
        "guided": "runs along a strip whose thickness moves it",
        "single": "has an inertia of its own, which no file of mechanics couples with that of others",
        "reel": "winds what changes its radius",
        "capstan": "turns a length of tape or strip into an angle",
        "sprung": "a joint with a spring ends at it",
        "heavy": "carries a weight whose pull changes with its angle",
        "wheel": "is driven at its rim",
    },
    "joint": {
        "spring": "a spring in the equations; where one spring has two nodes, one of them",
        "shaft": "passes on torque, and may have backlash",
        "span": "a length of tape, or held by one",
        "contact": "passes on force by friction",
        "rigid": "has no spring in the equations",
        "path": "a sensor looks through it at what the tape carries",
        "ground": "ends at the frame",
        "turning": "its first end turns",
        "turned": "its far end turns",
    },
    "drive": {
        "voltage": "its command is a voltage at the motor",
        "current": "its command is a current, held by an amplifier",
        "force": "its command is a force or a torque",
        "supply": "the first of the drives on one supply",
        "several": "one of several drives",
    },
    "sensor": {
        "position": "shows a position",
        "speed": "shows a speed",
        "counts": "shows whole counts",
        "edges": "shows edges without direction, seldomer than ticks",
        "turns": "of something that turns, or that is moved by something that turns",
        "slides": "of something that slides",
        "driven": "of a body that a drive acts on",
        "load": "of a body that no drive acts on",
        "guided": "of what runs along a strip",
        "lone": "the only sensor of the only body: nothing is between the drive and what it shows",
        "feedback": "a law closes the loop on it",
    },
    "loop": {},
}
GENERAL = "general"  # trait of any element but a loop, without a condition on the element
for _kind in ("body", "joint", "drive", "sensor"):
    TRAITS[_kind][GENERAL] = "described by what it is alone: no effect is left out for what is known of the machine"
KINDS = tuple(TRAITS)
NONE: frozenset[str] = frozenset()


class Element(NamedTuple):
    """One element of a machine: its node, its kind (body, joint, drive, sensor, loop), and its traits."""

    node: str
    kind: str
    traits: frozenset[str] = NONE


class Stand(NamedTuple):
    """Where an effect may stand: at each element of a kind that has all the traits that it needs."""

    element: str
    needs: frozenset[str] = NONE
    usual: bool = True  # the typical sizes of the effect are those of a place like this
    again: bool = False  # the effect is equivalent to the effect at another node: a search leaves it out
    offered: bool = True  # a search tries it on every record; else only as an alternative to another name
    ways: tuple[tuple[Any, ...], ...] = ()  # alternative searches at this place; empty: the search of the term


LOOP = Element("loop", "loop")


def element(node: str, kind: str, traits: str = "") -> Element:
    """Element with its traits as words. Raises ValueError for an unknown kind or trait."""
    return Element(node, kind, _traits(kind, traits))


def stand(
    kind: str,
    needs: str = "",
    *,
    usual: bool = True,
    again: bool = False,
    offered: bool = True,
    ways: tuple[tuple[Any, ...], ...] = (),
) -> Stand:
    """Stand with the traits that it needs as words; `ways` are parts of a search (plants/physics/search.py).

    Raises ValueError for an unknown kind or trait.
    """
    return Stand(kind, _traits(kind, needs), usual, again, offered, ways)


def _traits(kind: str, words: str) -> frozenset[str]:
    if kind not in TRAITS:
        raise ValueError(f"there is no element '{kind}'; there is {', '.join(KINDS)}")
    for word in words.split():
        if word not in TRAITS[kind]:
            known = ", ".join(TRAITS[kind]) or "none"
            raise ValueError(f"a {kind} has no trait '{word}'; its traits are {known}")
    return frozenset(words.split())
