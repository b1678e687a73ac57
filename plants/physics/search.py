"""How a search walks through the parameters of a term: which is its size, by what it is measured, where it starts.

Starts are shares of what a recording shows of the node: its rms speed, its span, the rms force of its drive.
"""

from typing import NamedTuple

INF = float("inf")


class Size(NamedTuple):
    """A parameter that is zero (or `offset`) where the effect is not; `share` of its measure is a typical size."""

    name: str
    measure: str
    share: float | tuple[float, ...]  # several are several starts
    signed: bool = False
    most: float = INF  # in units of share times measure
    least: float = -INF
    offset: str = ""  # "dry": on top of the base's dry friction
    undoes: str = ""  # what of the base's a negative one takes away, and no more: friction never pushes
    finest: float = 0.0  # in steps of the sensor: less is no effect that this sensor could show
    slight: float = 0.0  # in units of share times measure: less is missed by nobody, however clearly it shows
    blur: str = ""  # a measure: less may be what the owner's own value of the same is off by


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
    """A shape or a place whose starts the record itself suggests: peaks of `kind`
    (diagnose/search/suggestions.py)."""

    name: str
    kind: str
    reach: float = 0.15  # in logarithm for a shape, in shares of the span for a place
    place: bool = False
    lengths: tuple[float, float] = (0.0, INF)  # m, between which a wave that a lone sensor misreads is of this kind


class Where(NamedTuple):
    """A place that is where the machine starts or the middle of the travel. Elsewhere is a constant push besides, which
    has names of its own."""

    name: str


class Rest(NamedTuple):
    """Where a spring rests, anywhere: what it pulls with in the middle of the travel is the number that is fitted.
    Follows the Size of its stiffness; `share` of its measure is a typical pull there."""

    name: str
    measure: str
    share: float


class Jumps(NamedTuple):
    """The size of the largest of the jumps that the record shows; the others keep their share of it."""

    name: str


class Choice(NamedTuple):
    """A setting that is not fitted: words, or numbers in units of a measure."""

    name: str
    values: tuple
    measure: str = ""


Part = Size | Limit | Shape | Turn | At | Hint | Where | Rest | Jumps | Choice
