"""What a term of physics tells the emulator, the fit, and the mechanic who reads the report.

A term acts at one or more sites of a plant's substep. At each site it is one line of the generated plant, in which
these names are filled in:

    {p} {s}   its params and its state
    {m}       the machine's record (plants/linear.py)
    {i} {r}   the node's index, and the factor from the node's rotation to the term's own unit: 1, or the radius for a
              node that slides ({r} * {m}.vm[{i}] is the node's speed in the term's unit)
    {l}       the link (spring) that the node names: tape1, or the shaft that ends at a motor or a wheel
    {c}       the channel: of the drive for a drive, of the sensor for a sensor

The sites of a substep in their order:

    command   {m}.volts[{c}], what stands at the driver's input, may be changed; {m}.volts holds all drives
    force     {m}.qm and {m}.vm are position and speed at the middle of the substep; {r} times a force goes to
              {m}.f[{i}], {r} times a limit of dry friction to {m}.dry[{i}]; linear.pull({m}, {l}, T) pulls at a link
    last      as force, once every term has pushed and pulled: for what acts on all of it, as a reel that grows heavier,
              or pulls with what the others have left of a tension, as the arm of a wheel out of round
    reading   {m}.y[{c}], what the sensor would show before it is cut into counts, may be changed; {m}.x is the state at
              the sample, {m}.t its time. It may be called once a substep or once a tick: it keeps no memory.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings

SITES = ("command", "force", "last", "reading")
Node = Annotated[str, Field(description="where it acts; `rtctl physics TERM` lists the nodes of each machine")]


@dataclass(frozen=True)
class Term:
    """One effect that a machine can have beyond its equations."""

    name: str
    words: str
    equation: str
    source: str
    settings: type[Settings]
    build: Callable[[Any, float], Any]
    act: dict[str, str]  # site, or site:kind for one kind of plant -> line
    nodes: Mapping[str, tuple[str, ...]]  # plant kind -> nodes where it can stand
    look_alikes: dict[str, str]  # rival name -> the experiment that separates the two
    typical: dict[str, tuple[float, float]] = field(default_factory=dict)  # parameter -> range; see `scale`
    scale: dict[str, str] = field(default_factory=dict)  # parameter -> what its typical range is a multiple of
    axis: str = "velocity"  # where the effect shows: time, velocity, position, angle, command, tension, frequency
    passive: bool = True  # never feeds energy in
    moves: bool = False  # its reading line is where the carriage stands, not an error of a sensor
    tabled: bool = True  # the exchange format has its name
    state: np.dtype | None = None

    def act_at(self, site: str, kind: str) -> str | None:
        """Its line at a site of a plant, None where it does nothing there."""
        return self.act.get(f"{site}:{kind}", self.act.get(site))
