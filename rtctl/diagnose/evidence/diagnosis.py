"""Records of a diagnosis: effect, rival, location and interval, as in diagnosis.json."""

from typing import Any, NamedTuple

NAMED, AMBIGUOUS, UNNAMED, NOTHING = "named", "ambiguous", "unnamed", "nothing"


class Interval(NamedTuple):
    value: float
    low: float  # lower end of the 90 % interval
    high: float
    unit: str = ""

    def as_json(self) -> dict[str, Any]:
        """Value, ends of the interval and unit, as in diagnosis.json."""
        return {"value": self.value, "ci90": [self.low, self.high], "unit": self.unit}


class LookAlike(NamedTuple):
    """Look-alike of an effect, fitted in the place of the effect."""

    name: str
    node: str
    probability: float


class Effect(NamedTuple):
    """Term of physics that the recording supports."""

    name: str
    node: str
    confidence: float
    parameters: dict[str, Interval]
    look_alikes: tuple[LookAlike, ...]
    instead_of: str | None = None  # term:node of the effect that this one would replace; None: the effect is accepted


class Located(NamedTuple):
    """Location of the difference between simulation and recording."""

    channel: str
    node: str
    axis: str
    where: str  # location in words
    since_s: float
    share: float  # share of the residual that is located there
