"""Joints that a description calls rigid and that terms of physics make springs."""

from collections.abc import Iterable
from typing import Any

from rtctl.plants.graph.description import Description
from rtctl.plants.physics import TERMS


def sprung(machine: Description, terms: Iterable[Any]) -> tuple[Description, dict[str, float]]:
    """Description with the joints that `terms` make springs, and the numbers of these joints by dotted path; the
    unchanged description and no numbers where no term makes a spring."""
    found: dict[str, Any] = {}
    values: dict[str, float] = {}
    for settings in terms:
        made = TERMS[settings.term].joint
        numbers = made(settings) if made is not None and settings.node in machine.joints else {}
        if numbers:
            values |= {f"joints.{settings.node}.{key}": value for key, value in numbers.items()}
            found[settings.node] = machine.joints[settings.node].model_copy(update=numbers)
    if not found:
        return machine, {}
    return machine.model_copy(update={"joints": {**machine.joints, **found}}), values
