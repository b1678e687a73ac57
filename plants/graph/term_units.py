"""Units of the numbers of a term at a node of a described machine."""

from collections.abc import Mapping
from typing import Any

from rtctl.config.units import to_si
from rtctl.plants.graph.description import Description, Drive, Sensor
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.dimensions import BY_NODE, DIMENSIONS


def body_of(machine: Description, node: str) -> str:
    """The body that moves at a node, and whose unit the node has; "" for none.

    Of a joint it is `to`, of a joint that ends at the frame `from`; of a drive or sensor that of its place.
    """
    if node in machine.bodies:
        return node
    if node in machine.joints:
        joint = machine.joints[node]
        return str(getattr(joint, "from") if machine.is_frame(joint.to) else joint.to)
    for group in (machine.drives, machine.sensors):
        element: Any = group.get(node)
        if element is not None:
            if element.body is not None:
                return str(element.body)
            return body_of(machine, str(element.joint or element.drive))
    return ""


def ends_turn(machine: Description, name: str) -> tuple[bool, bool]:
    """Whether the two ends of a joint turn; the frame is as the other end. A span is a length of tape: it slides."""
    joint = machine.joints[name]
    if joint.span is not None:
        return False, False
    a, b = getattr(joint, "from"), joint.to
    one, two = machine.turns(a), machine.turns(b)
    return two if machine.is_frame(a) else one, one if machine.is_frame(b) else two


def turns_at(machine: Description, element: Drive | Sensor) -> bool:
    """Whether what a drive moves or a sensor shows is an angle; that of a joint is in units of `to`."""
    if element.body is not None:
        return machine.turns(element.body)
    if element.joint is not None:
        return ends_turn(machine, element.joint)[1]
    assert isinstance(element, Sensor)  # a drive acts on a body or a joint
    return turns_at(machine, machine.drives[str(element.drive)])


def unit_at(machine: Description, term: str, node: str, parameter: str) -> str:
    """Unit of a term's parameter at a node; "" for a bare number."""
    known = TERMS[term]
    unit = known.units.get(parameter, "") or _own_unit(term, parameter) or BY_NODE.get(parameter, "")
    if unit in DIMENSIONS:
        return DIMENSIONS[unit][not machine.turns(body_of(machine, node))]
    if unit == "V" and node in machine.drives:
        return machine.drives[node].unit
    return unit


def _own_unit(term: str, parameter: str) -> str:
    """Unit that the settings of a term declare, the same at every node; "" for none."""
    field = TERMS[term].settings.model_fields.get(parameter)
    extra = field.json_schema_extra if field is not None else None
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def entry_in_si(machine: Description, entry: Mapping[str, Any]) -> dict[str, Any]:
    """Entry of a `physics` list whose texts with a unit by node, such as `20 mNm`, are SI numbers.

    Raises ValueError that names the parameter where its unit does not fit the node.
    """
    term, node = str(entry["term"]), str(entry.get("node"))
    out = dict(entry)
    for key, value in entry.items():
        if isinstance(value, str) and key in TERMS[term].settings.model_fields and not _own_unit(term, key):
            unit = unit_at(machine, term, node, key)
            if unit:
                try:
                    out[key] = to_si(value, unit)
                except ValueError as error:
                    raise ValueError(f"{key}: {error}") from None
    return out
