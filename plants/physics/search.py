"""Search of a term's parameters: the size, its measure, and the starts.

Starts are shares of measures of the node in a recording: its rms speed, its span, the rms force of its drive.
"""

from typing import NamedTuple

INF = float("inf")


class Size(NamedTuple):
    """A parameter that is zero (or `offset`) without the effect; `share` of its measure is a typical size."""

    name: str
    measure: str
    share: float | tuple[float, ...]  # several are several starts
    signed: bool = False
    most: float = INF  # in units of share times measure
    least: float = -INF
    offset: str = ""  # "dry": on top of the base's dry friction
    undoes: str = ""  # nominal friction that bounds a negative size, so that friction stays passive
    finest: float = 0.0  # in steps of the sensor: least size that this sensor can resolve
    slight: float = 0.0  # in units of share times measure: least relevant size, whatever its significance
    blur: str = ""  # a measure of the tolerance of the nominal value: a smaller size may be an error of this value


class Shape(NamedTuple):
    """A positive parameter that gives the effect its form; `starts` in units of its measure."""

    name: str
    measure: str
    starts: tuple[float, ...]
    reach: float = 20.0  # factor beyond the outermost starts that a fit may go
    fixed: bool = False  # stays at its start


class Limit(NamedTuple):
    """A limit: without effect while it is far off; `starts` in units of its measure."""

    name: str
    measure: str  # or a kind of hint, where there are no starts
    starts: tuple[float, ...] = ()


class Turn(NamedTuple):
    """An amplitude with its phase."""

    amplitude: str
    phase: str
    measure: str
    share: float


class At(NamedTuple):
    """A place and a width along the travel: wide ones at `places` of them, narrow ones at spots that stand out."""

    name: str
    width: str
    places: int
    wide: float  # of the span
    narrow: float


class Hint(NamedTuple):
    """A shape or a place with starts from the record: peaks of `kind`
    (diagnose/search/suggestions.py)."""

    name: str
    kind: str
    reach: float = 0.15  # in logarithm for a shape, in shares of the span for a place
    place: bool = False
    lengths: tuple[float, float] = (0.0, INF)  # m, range of wavelengths of this kind, for errors of a lone sensor


class Where(NamedTuple):
    """A place at the start of the machine or in the middle of the travel. Another place adds a constant force, which
    other terms name."""

    name: str


class Rest(NamedTuple):
    """Rest position of a spring, anywhere. The fitted number is the pull of the spring in the middle of the travel.
    Follows the Size of its stiffness; `share` of its measure is a typical pull there."""

    name: str
    measure: str
    share: float


class Jumps(NamedTuple):
    """Size of the largest jump in the record; the other jumps keep their ratio to it."""

    name: str


class Choice(NamedTuple):
    """A setting that is not fitted: words, or numbers in units of a measure."""

    name: str
    values: tuple
    measure: str = ""


Part = Size | Limit | Shape | Turn | At | Hint | Where | Rest | Jumps | Choice
