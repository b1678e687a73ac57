"""What a diagnosis says, and its form in diagnosis.json."""

from typing import Any, NamedTuple

NAMED, AMBIGUOUS, UNNAMED, NOTHING = "named", "ambiguous", "unnamed", "nothing"


class Interval(NamedTuple):
    value: float
    low: float  # of the 90 % interval
    high: float
    unit: str = ""

    def as_json(self) -> dict[str, Any]:
        """Value, ends of the interval and unit, as in diagnosis.json."""
        return {"value": self.value, "ci90": [self.low, self.high], "unit": self.unit}


class Rival(NamedTuple):
    """A look-alike of an effect that was fitted in its place."""

    name: str
    node: str
    p_value: float  # of explaining the record as well
    rms: float  # of its weighted error


class Effect(NamedTuple):
    """A term of physics that the record asks for."""

    name: str
    node: str
    confidence: float
    parameters: dict[str, Interval]
    look_alikes: tuple[Rival, ...]
    instead_of: str | None = None  # term:node of the effect before it whose place it would take; None: it stands itself


class Located(NamedTuple):
    """Where simulation and recording part."""

    channel: str
    node: str
    axis: str
    where: str  # in words
    since_s: float
    share: float  # of the error that lives there
