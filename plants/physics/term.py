"""What a term of physics tells the emulator, the fit, and the mechanic who reads the report."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.idiom import Settings


@dataclass(frozen=True)
class Term:
    """One effect that a machine can have beyond its equations.

    `act` is how a generated plant calls it, once a substep, with these names filled in: {p} and {s} its params and
    state, {m} the machine's record, {i} the node's index, {r} the factor from the node's rotation to the term's own
    unit (1, or a radius for a node that slides). It adds a smooth force to {m}.f or a limit of dry friction to {m}.dry.
    """

    name: str
    words: str
    equation: str
    source: str
    settings: type[Settings]
    build: Callable[[Any, float], Any]
    act: str
    nodes: dict[str, tuple[str, ...]]  # plant kind -> nodes where it can stand
    look_alikes: dict[str, str]  # rival name -> the experiment that separates the two
    typical: dict[str, tuple[float, float]] = field(
        default_factory=dict
    )  # parameter -> range; friction in base friction
    state: np.dtype | None = None
