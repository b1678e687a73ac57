"""Declarations of a term for reports and searches: its phrase, its needs of a record, and its range when hidden."""

from collections.abc import Mapping
from typing import NamedTuple

BOTH = "moves in both directions"
TURNS = "at least a full turn"
BEHIND = "long moves, with a sensor behind the contact"
WAVES = "moves over several waves, with a second sensor"
PASSES = "several passages of the same place"


class Phrase(NamedTuple):
    """Phrase of one effect in reports. `head` and `detail` are filled in by the names of the parameters:

    {F_C} its size with unit, {a:%} a share in percent, {a:more|less} a word by its sign, {offset:+} the signed value,
    {at:3} three figures, {here} the node, {form:words} the words of the form that was chosen, {harmonics:words} the
    harmonics that were found.
    """

    noun: str
    head: str
    detail: str
    need: str  # contents of a record that shows the effect
    forms: Mapping[str, str] = {}  # value of `form` -> its words; "" for all others; {command} is the command's name
    again: str = ""  # what follows "twice" and "three times" of its harmonics


class Needs(NamedTuple):
    """Contents of a record that are needed to test the effect."""

    turns: float = 0.0  # turns of its node
    compared: bool = False  # another sensor to compare with
    alone: str = ""  # condition under which a lone sensor suffices: a node that "slides", or an "unsigned" speed
    stiffness: bool = False  # a spring at its node
    dry: bool = False  # dry friction at its node, which it alters
    friction: bool = False  # dry or viscous friction at its node, which it alters
    both_ways: bool = False  # motion of its node in both directions, between which it differs


NOTHING = Needs()


class Draw(NamedTuple):
    """Range of a parameter in units of a measure, drawn evenly in its logarithm; `signed`: either sign."""

    low: float
    high: float
    measure: str = "one"
    signed: bool = False
