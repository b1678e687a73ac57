"""What a plant declares for curves of terms (physics/portrait.py) and for files of a user's own (rtctl/own)."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple


class Shown(NamedTuple):
    """How a plant is held by the hand while a curve of a term is drawn."""

    axes: tuple[str, ...]  # of a term, that this plant shows better than others
    drives: tuple[Any, ...]  # further arguments of `build`
    parameters: dict[str, float]  # that differ from the usual set
    units: tuple[str, str]  # of way and push, where nothing slides
    scales: dict[str, float]  # what typical sizes are multiples of
    ratios: Callable[[Any], list[float]]  # params -> how the nodes turn together when nothing is stretched (nq)
    links: Mapping[str, int] = MappingProxyType(
        {}
    )  # node -> link whose pull it carries, where it is another than that of LINKS
    stretches: bool = False  # whether the hand stretches a joint by the coordinate at its end


class Own(NamedTuple):
    """What an emulated machine in a file of the user's own gets and has to leave, and what templates write."""

    inputs: dict[str, str]  # name that `step` may ask for -> expression in the generated lines
    sensors: tuple[str, ...]  # state fields that the board counts and converts
    truth: tuple[str, ...]  # state fields, in the order of the truth columns
    unit: str  # of position
    node: str  # where a new term stands
    drag: float  # of the term, in the node's unit of force over speed
    gains: tuple[str, ...]  # of the PD that the template is, beside what the config of the machine has
    cutoff: float = 40.0  # Hz, of the template's filter
