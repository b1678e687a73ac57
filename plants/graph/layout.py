"""Layout of a described machine: which coordinate, link and channel each element has.

Bodies that rigid joints connect share one coordinate, that of the first of them in the description; each body moves
`ratio` times as far. The frame has none.
"""

from typing import Any, NamedTuple

from rtctl.plants.graph.description import Description
from rtctl.plants.linear import MOST_BODIES

NOWHERE = -1


class Body(NamedTuple):
    coordinate: int  # index into the positions; NOWHERE for the frame
    chain: tuple[tuple[str, bool], ...]  # rigid joints from the coordinate's own body; whether passed from -> to


class Layout(NamedTuple):
    """Numbers of a machine's elements."""

    machine: Description
    bodies: dict[str, Body]
    links: dict[str, int]  # joints that are springs
    drives: dict[str, int]
    sensors: dict[str, int]
    nq: int

    def ratio(self, body: str, values: dict[str, float]) -> float:
        """Motion of a body for one unit of its coordinate, by the ratios in `values`; 0 for the frame."""
        place = self.bodies.get(body)
        if place is None or place.coordinate == NOWHERE:
            return 0.0
        ratio = 1.0
        for joint, forward in place.chain:
            n = values[f"joints.{joint}.ratio"]
            ratio = ratio * n if forward else ratio / n
        return ratio

    def coordinate(self, body: str) -> int:
        """Index of the coordinate of a body; 0 for the frame, whose ratio is 0."""
        place = self.bodies.get(body)
        return place.coordinate if place is not None and place.coordinate != NOWHERE else 0


def layout(machine: Description) -> Layout:
    """Layout of a description. Raises ValueError where it has more coordinates than a machine can have."""
    return _layout(machine.model_dump_json(), machine)


_known: dict[str, Layout] = {}


def _layout(text: str, machine: Description) -> Layout:
    if text not in _known:
        _known[text] = _made(machine)
    return _known[text]


def _made(machine: Description) -> Layout:
    near: dict[str, list[tuple[str, str, bool]]] = {name: [] for name in machine.bodies}
    for name, joint in machine.joints.items():
        if joint.stiffness is None:
            a, b = getattr(joint, "from"), joint.to
            near[a].append((b, name, True))
            near[b].append((a, name, False))
    bodies: dict[str, Body] = {}
    nq = 0
    for first in machine.bodies:
        if machine.is_frame(first):
            bodies[first] = Body(NOWHERE, ())
        elif first not in bodies:
            bodies[first] = Body(nq, ())
            todo = [first]
            while todo:
                here = todo.pop()
                for other, held, forward in near[here]:
                    if other not in bodies:
                        bodies[other] = Body(nq, (*bodies[here].chain, (held, forward)))
                        todo.append(other)
            nq += 1
    if nq > MOST_BODIES:
        raise ValueError(f"bodies: {nq} move independently; {MOST_BODIES} is the most that one machine can have")
    springs = [name for name, joint in machine.joints.items() if joint.stiffness is not None]
    return Layout(
        machine,
        bodies,
        {name: i for i, name in enumerate(springs)},
        {name: i for i, name in enumerate(machine.drives)},
        {name: i for i, name in enumerate(machine.sensors)},
        nq,
    )


def ends(layout: Layout, joint: Any) -> tuple[str, str]:
    """Names of the two ends of a joint."""
    return getattr(joint, "from"), joint.to
