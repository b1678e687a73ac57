"""What a machine does in ordinary use: how far and how fast it moves, and what that takes at each node."""

from collections.abc import Callable
from typing import Any, NamedTuple


class Use(NamedTuple):
    """A node in ordinary use, in its own unit."""

    speed: float
    travel: float
    force: float
    dry: float
    inertia: float
    stiffness: float
    contact: float
    slides: bool  # m, not rad


class Duty(NamedTuple):
    """Ordinary use of a kind of machine: the main node moves at a nominal speed over a nominal travel."""

    speed: float  # rad/s or m/s
    travel: float  # rad or m
    recording: float  # s, length of a recording that shows it all
    use: Callable[[str, Any], Use]  # node, config -> its use; a drive, or the loop, as the node that moves first
    volts: Callable[[Any], float]  # config -> command, rms
