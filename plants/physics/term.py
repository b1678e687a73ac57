"""Term of physics: its declarations for the emulator, the fit, and the report.

A term acts at one or more sites of a plant's substep. At each site it is one line of the generated plant, in which
these names are filled in:

    {p} {s}   its params and its state
    {m}       the machine's record (plants/linear.py)
    {i} {r}   the node's index, and the factor from the node's rotation to the term's own unit: 1, or the radius for a
              node that slides ({r} * {m}.vm[{i}] is the node's speed in the term's unit)
    {l}       the link (spring) that the node names: tape1, or the shaft that ends at a motor or a wheel
    {c}       the channel: of the drive for a drive, of the sensor for a sensor
    {k}       of a described machine: the link on the other side of the body that the tape of {l} lies around; of {l},
              {k} and {c} each is -1 where there is none

The sites of a substep in their order:

    command   {m}.volts[{c}], the voltage at the driver's input, may be changed; {m}.volts holds all drives
    force     {m}.qm and {m}.vm are position and speed at the middle of the substep; {r} times a force goes to
              {m}.f[{i}], {r} times a limit of dry friction to {m}.dry[{i}]; linear.pull({m}, {l}, T) pulls at a link
    last      as force, after the forces of all terms: for a term that acts on the total force, as a growing inertia of
              a reel, or on the total tension, as the lever of a wheel out of round
    reading   {m}.y[{c}], the reading of the sensor before quantisation, may be changed; {m}.x is the state at the
              sample, {m}.t its time. A reading is computed once a substep or once a tick: it keeps no memory.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings
from rtctl.plants.element import Stand
from rtctl.plants.physics.search import Choice, Part
from rtctl.plants.physics.story import NOTHING, Draw, Needs, Phrase

SITES = ("command", "force", "last", "reading")
REMEDIES = {  # kind of remedy -> what it is; rtctl/improve/ makes each
    "feedforward": "its own law along the reference, before it acts",
    "integral": "integral with a dead zone in the error, for what a feedforward leaves at rest",
    "curve": "inverse of the drive's static curve",
    "joint": "reference through the joint: the feedback runs ahead by what the joint gives way",
    "notch": "notch at its frequency",
    "table": "table of the sensor's error over a turn or the travel",
    "lead": "reference taken ahead by the time until a command acts",
    "delay": "gains for the true delay",
    "behind": "reference of the time that the sensor shows",
    "limits": "slower reference, so that it does not happen",
    "tension": "another tension of the tape",
    "observer": "disturbance observer",
    "sensor": "none in a law: the sensor is to be repaired",
}
Node = Annotated[str, Field(description="place of the effect; `rtctl physics TERM` lists the nodes of each machine")]


@dataclass(frozen=True)
class Term:
    """One effect that a machine can have beyond its equations, with its declarations.

    A term in a user file gives the fields without a default; all other fields are optional.
    """

    name: str
    words: str
    equation: str
    source: str
    settings: type[Settings]
    build: Callable[[Any, float], Any]
    act: dict[str, str]  # site, or site:kind for one kind of plant -> line
    stands: tuple[Stand, ...]  # elements at which it can stand; see plants/physics/placement.py
    look_alikes: dict[str, str]  # rival name -> the experiment that separates the two
    typical: dict[str, tuple[float, float]] = field(default_factory=dict)  # parameter -> range; see `scale`
    scale: dict[str, str] = field(default_factory=dict)  # parameter -> what its typical range is a multiple of
    axis: str = "velocity"  # where the effect shows: time, velocity, position, angle, command, tension, frequency
    passive: bool = True  # never feeds energy in
    moves: bool = False  # its reading line is a motion of the carriage, not an error of a sensor
    since: int = 1  # first exchange format that has its name; 0: none has
    order: int = 0  # in which terms act, the lowest first: elongation and slip of springs before friction
    shown: str = ""  # motion of its curve, where the motion of `axis` shows less (portrait.py)
    state: np.dtype | None = None

    # for reports
    phrase: Phrase | None = None
    check: str = ""  # what a mechanic should look at on the machine, one sentence
    units: Mapping[str, str] = field(
        default_factory=dict
    )  # parameter -> unit, or dimension by its node (dimensions.py)
    contact: bool = False  # acts in m and N where its contact drives a tape or a carriage

    # needs of a record, and search
    needs: Needs = NOTHING
    search: tuple[Part, ...] = ()  # of the plain form; without it the first of `typical` is the size
    sliding: tuple[Part, ...] = ()  # of the plain form where its node slides; empty: `search`
    richer: tuple[Part, ...] = ()  # further parameters, tried once the plain form is accepted
    richer_at: str = ""  # kind of element at which it has its richer form; empty: all kinds
    variants: Choice | None = None  # a setting whose other values are tried once the term is accepted
    counted: tuple[str, ...] = ()  # parameters that are whole numbers: slots and poles
    static: bool = False  # a function of what `axis` says, without memory
    joint: Callable[[Any], dict[str, float]] | None = None  # numbers of the joint at its node
    seldom: float = 0.0  # nats of prior odds against it, where an equivalent law has a more usual name
    round: str = ""  # name of the equivalent law at a body that makes whole turns
    stiff: bool = False  # alters a spring: simulated in shorter steps
    slips: bool = False  # a contact that slips: the bodies behind it move freely
    unsigned: bool = False  # a reading without direction
    clock: bool = False  # of the ticks: shows in the noise, not in the error of a fit

    # friction
    friction: str = ""  # kind of friction of a body that its first size adds to: "dry", "viscous"
    falls_to: str = ""  # friction of its node to which its own friction falls with speed: "dry"
    replaces: str = ""  # friction of its node that it replaces: "dry"

    # remedies in the order in which they are tried; see REMEDIES
    remedies: tuple[str, ...] = ()

    # sizes of a hidden effect of `plant --conceal`
    draws: Mapping[str, Draw] = field(default_factory=dict)  # ranges in place of the typical ones
    chosen: Mapping[str, tuple] = field(default_factory=dict)  # settings that are chosen rather than sized

    @property
    def tabled(self) -> bool:
        """Whether the first exchange format has its name."""
        return self.in_format(1)

    def in_format(self, number: int) -> bool:
        """Whether an exchange format has its name."""
        return 0 < self.since <= number

    def act_at(self, site: str, kind: str) -> str | None:
        """Line of the term at a site of a plant, None where the term does not act there."""
        return self.act.get(f"{site}:{kind}", self.act.get(site))
