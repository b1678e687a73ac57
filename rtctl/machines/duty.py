"""Nominal duty of a machine: travel and speed, and the force at each node."""

from collections.abc import Callable
from typing import Any, NamedTuple


class Use(NamedTuple):
    """Nominal duty of a node, in the node's unit."""

    speed: float
    travel: float
    force: float
    dry: float
    inertia: float
    stiffness: float
    contact: float
    slides: bool  # m, not rad


class Duty(NamedTuple):
    """Nominal duty of a kind of machine: the main node moves at a nominal speed over a nominal travel."""

    speed: float  # rad/s or m/s
    travel: float  # rad or m
    recording: float  # s, length of a recording that shows the duty
    use: Callable[[str, Any], Use]  # node, config -> duty of the node; a drive or the loop counts as the first node
    volts: Callable[[Any], float]  # config -> command, rms
