"""Declarations of a plant for curves of terms (physics/portrait.py) and for user files (rtctl/own)."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple


class Shown(NamedTuple):
    """Prescribed motion and scales of a plant for the curve of a term."""

    axes: tuple[str, ...]  # axes of terms for which this plant is preferred
    drives: tuple[Any, ...]  # further arguments of `build`
    parameters: dict[str, float]  # that differ from the usual set
    units: tuple[str, str]  # of position and force, where nothing slides
    scales: dict[str, float]  # units of typical sizes
    ratios: Callable[[Any], list[float]]  # params -> rigid motion of the nodes, without elongation (nq)
    links: Mapping[str, int] = MappingProxyType(
        {}
    )  # node -> link whose pull it carries, where it is another than that of LINKS
    stretches: bool = False  # whether a joint is stretched by the coordinate at its end


class Own(NamedTuple):
    """Inputs and state fields of an emulated machine in a user file, and values of the templates."""

    inputs: dict[str, str]  # name that `step` may ask for -> expression in the generated lines
    sensors: tuple[str, ...]  # state fields that the board counts and converts
    truth: tuple[str, ...]  # state fields, in the order of the truth columns
    unit: str  # of position
    node: str  # of a new term
    drag: float  # of the term, in the node's unit of force over speed
    gains: tuple[str, ...]  # of the template's PD, in addition to those in the config of the machine
    cutoff: float = 40.0  # Hz, of the template's filter
