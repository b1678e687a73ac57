"""Every hypothesis that a record can be asked about: each term of the library at each node where it can stand.

The table says how a search walks through a term's parameters: which one is its size, by what it is measured, and from
which shapes (speeds, times, frequencies) it starts. Starts are shares of what the recording itself shows of the node:
its rms speed, its span, the rms force of its drive.
"""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.model import Model, dry_with_terms
from rtctl.diagnose.quantities import of_case
from rtctl.diagnose.record import Record
from rtctl.diagnose.scales import node_scales
from rtctl.diagnose.space import COSINE, INVERSE, PLACE, SHAPE, SINE, SIZE, Coordinate, Hypothesis
from rtctl.diagnose.tacho import counts_up
from rtctl.diagnose.yardstick import Measures
from rtctl.idiom import Settings
from rtctl.own.term import sizes
from rtctl.plants.physics import TERMS


class Size(NamedTuple):
    """A parameter that is zero (or `offset`) where the effect is not; `share` of its measure is a typical size."""

    name: str
    measure: str
    share: float | tuple[float, ...]  # several are several starts
    signed: bool = False
    most: float = np.inf  # in units of share times measure
    least: float = -np.inf
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
    """A shape or a place whose starts the record itself suggests: peaks of `kind` (see `hints`)."""

    name: str
    kind: str
    reach: float = 0.15  # in logarithm for a shape, in shares of the span for a place
    place: bool = False


class Where(NamedTuple):
    """A place that is where the machine starts or the middle of the travel. Elsewhere is a constant push besides, which
    has names of its own."""

    name: str


class Jumps(NamedTuple):
    """The size of the largest of the jumps that the record shows; the others keep their share of it."""

    name: str


class Choice(NamedTuple):
    """A setting that is not fitted: words, or numbers in units of a measure."""

    name: str
    values: tuple
    measure: str = ""


USUAL = {("ldu", "carriage"), ("ivu", "motor1"), ("ivu", "motor2"), ("ivu", "capstan"), ("axis", "carriage")}  # nodes
SLIGHT = 0.01  # of the force that moves a node: dry friction that nothing else could be told by
TURN = 0.1  # rad, by which a ripple's far end may move in a difference quotient
Part = Size | Limit | Shape | Turn | At | Hint | Where | Jumps | Choice
SEARCH: dict[str, tuple[Part, ...]] = {
    "friction.coulomb": (Size("F_C", "force", 0.1, signed=True, undoes="dry", slight=0.1),),
    "friction.viscous": (Size("B", "drag", 0.1, signed=True, undoes="thick"),),
    "friction.stribeck": (
        Size("F_s", "force", 0.1, offset="dry"), Shape("v_s", "speed", (0.012, 0.035, 0.1, 0.3, 0.9), 4.0),
    ),
    "friction.presliding": (Size("z_s", "span", 1e-3, finest=2.0), Choice("form", ("dahl", "lugre"))),
    "friction.asymmetry": (Size("a", "one", 0.2, signed=True, least=-4.9, most=4.9),),
    "friction.load": (Size("mu", "one", 0.05, signed=True),),
    "transmission.backlash": (
        Size("gap", "twist", (0.3, 5.0, 60.0)), Choice("damping", (0.0, 1.0)), Choice("edge", (0.005, 0.1)),
    ),
    "transmission.slip": (Limit("F_max", "grip"),),
    "transmission.creep": (Size("kappa", "compliance", 1e-3),),
    "structure.resonance": (
        Size("mass", "inertia", 0.1),
        Shape("f_Hz", "ring", (3.0, 6.0, 11.0, 19.0, 30.0, 43.0, 60.0, 85.0, 120.0, 165.0, 225.0), 1.4),
        Shape("zeta", "one", (0.02,), 30.0),
    ),
    "structure.stiffening": (Size("c3", "cubic", 0.2, signed=True),),
    "tape.viscoelastic": (Size("c_branch", "stiffness", 0.5), Shape("tau", "seconds", (0.01, 0.05, 0.25, 1.2))),
    "load.spring": (Size("k", "stiff", 0.2, signed=True), Where("x0")),
    "load.imbalance": (Turn("A", "phi", "force", 0.1),),
    "load.bump": (
        Size("F", "force", 0.2, signed=True), At("at", "width", 8, 0.05, 0.012),
        Choice("form", ("drag", "hill", "push")),
    ),
    "drive.offset": (Size("offset", "volts", 0.05, signed=True, slight=0.05),),
    "drive.deadband": (Size("band", "volts", 0.1), Choice("form", ("shift", "cut", "floor"))),
    "drive.gain_asymmetry": (Size("a", "one", 0.1, signed=True),),
    "drive.saturation": (Limit("limit", "peak", (0.5, 0.8)),),
    "drive.lag": (Size("tau", "tick", 0.5, blur="driver"), Choice("order", (1, 2))),
    "drive.supply_sag": (Size("k", "per_volt", 0.05), Choice("form", ("current", "power"))),
    "drive.thermal": (
        Size("a", "one", 0.1, signed=True), Shape("tau", "duration", (0.1, 0.5, 2.0), 5.0),
        Choice("V_ref", (1.0,), "volts"),
    ),
    "timing.delay": (Size("extra", "tick", 0.5, blur="driver"),),
    "ripple.cogging": (Turn("A", "phi", "force", 0.05), Hint("per_turn", "order")),
    "ripple.encoder": (Turn("A", "phi", "one", 2e-3),),
    "ripple.reel": (Turn("e", "phi", "one", 1e-4),),
    "ripple.capstan": (Turn("a", "phi", "one", 1e-5),),
    "guide.thickness": (Turn("A", "phi", "one", 5e-6), Hint("wavelength", "wavelength", 0.6)),
    "guide.dirt": (
        Size("A", "one", 1e-5, signed=True), Hint("at", "spot", 0.05, True), Shape("width", "span", (0.02,), 10.0),
    ),
    "sensor.missed_counts": (Jumps("size"),),
    "sensor.rectified": (Choice("share", (1.0,)),),
    "sensor.scale": (Size("relative", "one", 1e-3, signed=True),),
    "geometry.radius_change": (Size("d", "one", 1e-4, signed=True), Choice("other", (1.0, 0.0))),
    "tape.slack": (Choice("share", (1.0,)), Choice("other", (1.0, 0.0))),
}  # fmt: skip


BEYOND: dict[str, tuple[Part, ...]] = {  # what has no name in the table, looked for where a name may stand for it
    "friction.quadratic": (Size("Q", "drag2", 0.1),),
}
ALL = SEARCH | BEYOND


ALONE = ("sensor.scale", "sensor.rectified", "guide.thickness", "guide.dirt")  # asks for a second sensor
FALLING = "friction.stribeck"  # to what dry friction there is
TWICE = {("guide.thickness", "scale"), ("guide.dirt", "scale")}  # where a term does what it does at its other node
TURNING = {"axis": ("load.imbalance",)}  # ask for an axis that turns
SLIDING: dict[str, tuple[Part, ...]] = {  # what a linear axis has instead
    "ripple.encoder": (Turn("A", "phi", "one", 1e-5), Hint("turn", "wavelength", 0.4)),
    "ripple.cogging": (Turn("A", "phi", "force", 0.05), Hint("turn", "wavelength", 0.4)),
}
HINTED = tuple(  # whose starts the record suggests
    name for name, parts in (SEARCH | SLIDING).items() if any(isinstance(part, Hint | Jumps | At) for part in parts)
)
ONCE = 1.5  # times a turn: what comes less often is no cogging of a shaft that may be out of balance, which has teeth
LENGTHS = {  # m, between which a wave that a linear axis misreads is of its screw or encoder, and of its guide
    "turn": (0.0, 0.045),
    "wavelength": (0.012, np.inf),
}


def hypotheses(
    record: Record,
    base: dict[str, float],
    hints: dict[str, list] | None = None,
    only: Iterable[str] = (),
    beside: Sequence[Settings] = (),
) -> list[Hypothesis]:
    """All of them for this plant, one for each start; `only` restricts to terms by name.

    `hints` gives, as "kind" or "kind:node", what the record suggests for a Hint (see `hints.py`). `beside` are the
    terms that the model has already: friction that falls with speed asks for dry friction that it falls to.
    """
    model = Model(record.plant, base, tuple(beside), of_case(record.case))
    scales = node_scales(record, base)
    measures = Measures(record, base, scales, hints or {})
    blind = record.shows_speed or counts_up(record)  # what a sensor without direction makes of any motion
    alone = set(ALONE) - ({"sensor.rectified"} if blind else set())
    out = []
    for name, term in TERMS.items():
        if (
            (name in SEARCH or name in only or sizes(name))
            and not (name in ALONE and len(record.y) < 2 and record.plant == "ldu")
            and (not only or name in only)
        ):
            for node in term.nodes.get(record.plant, ()):
                slides = record.plant == "axis" and not model.units.rotary
                if (
                    (name, node) in TWICE
                    or (node == "sensor" and name in alone and not (slides and name == "guide.thickness"))
                    or (not model.units.rotary and name in TURNING.get(record.plant, ()))
                    or (name == FALLING and dry_with_terms(model, node) <= SLIGHT * measures.of("force", node))
                ):
                    continue
                out += starts_of(name, node, (slides and SLIDING.get(name)) or parts_of(name), measures)
    return out


def parts_of(name: str) -> tuple[Part, ...]:
    """What is fitted of a term; of one in a file of the user's own, what it calls typical, the first being its size."""
    if name in ALL:
        return ALL[name]
    (first, (low, high)), *others = sizes(name).items()
    more = (Shape(n, "one", ((a * b) ** 0.5,), (b / a) ** 0.5) for n, (a, b) in others)
    return (Size(first, "one", (low * high) ** 0.5), *more)


def starts_of(term: str, node: str, parts: tuple[Part, ...], m: Measures) -> list[Hypothesis]:
    """One hypothesis for each combination of starts."""
    m.term = term
    axes: list[list[tuple[tuple[Coordinate, ...], dict]]] = [list(_options(part, node, m)) for part in parts]
    out = []
    for combination in product(*axes):
        coordinates = tuple(c for option, _ in combination for c in option)
        fixed = {k: v for _, extra in combination for k, v in extra.items()}
        out.append(Hypothesis(term, node, coordinates, fixed))
    return out


def _options(part: Part, node: str, m: Measures) -> Iterable[tuple[tuple[Coordinate, ...], dict]]:
    if isinstance(part, Size):
        offset = m.dry(node) if part.offset == "dry" else 0.0
        shares = part.share if isinstance(part.share, tuple) else (part.share,)
        top = part.most if part.most < np.inf else 0.5 * m.most(part.name)
        for scale in dict.fromkeys(min(x * m.of(part.measure, node), top) for x in shares):
            least = part.least if part.signed else part.finest * m.of("grain", node) / scale
            if part.undoes:
                least = -(m.dry(node) if part.undoes == "dry" else m.thick(node)) / scale - 1e-3
            most = part.most / scale if part.measure == "one" else part.most
            slight = max(part.slight, m.of(part.blur, node) / scale if part.blur else 0.0)
            yield (Coordinate(part.name, SIZE, scale, least, most, offset=offset, slight=slight),), {}
    elif isinstance(part, Shape):
        measure = m.of(part.measure, node)
        low, high = min(part.starts) * measure / part.reach, max(part.starts) * measure * part.reach
        for start in part.starts:
            value = start * measure
            if part.fixed:
                yield (), {part.name: value}
            else:
                yield (Coordinate(part.name, SHAPE, value, np.log(low / value), np.log(high / value)),), {}
    elif isinstance(part, Limit):
        limits = [start * m.of(part.measure, node) for start in part.starts]
        for limit in limits or m.hints.get(f"{part.measure}:{node}", []):
            yield (Coordinate(part.name, INVERSE, limit, 0.0),), {}
    elif isinstance(part, Turn):
        scale = part.share * m.of(part.measure, node)
        name = f"{part.amplitude}|{part.phase}"
        yield (Coordinate(name, COSINE, scale), Coordinate(name, SINE, scale)), {}
    elif isinstance(part, Hint):
        found = m.hints.get(f"{part.kind}:{node}", m.hints.get(part.kind, []))
        s = m.scale(node)
        if node == "sensor" and part.kind == "wavelength":
            low, high = LENGTHS[part.name]
            found = [value for value in found if low < value < high]
        if part.kind == "order" and node in TERMS["load.imbalance"].nodes.get(m.record.plant, ()):
            found = [value for value in found if value > ONCE]
        for value in found:
            if part.place:
                yield (Coordinate(part.name, PLACE, part.reach * s.span, -3.0, 3.0, offset=s.at(value)),), {}
            else:
                turns = s.span * (value if part.kind == "order" else 2 * np.pi / value)  # rad, along the whole way
                step, longest = min(1e-2, TURN / turns), part.reach
                if part.kind == "wavelength":  # less than a whole one is a spring and a push, or any curve
                    least = 2 if _sprung(m) else 1  # where a spring has to bend a single one may be its own law's
                    longest = min(longest, float(np.log(turns / (2 * np.pi * least))))
                if longest > 0.0:
                    yield (Coordinate(part.name, SHAPE, value, -part.reach, longest, step=step),), {}
    elif isinstance(part, Where):
        yield (), {}
        if not _sprung(m):  # whose own spring would take up all but a push
            yield (), {part.name: m.scale(node).at(0.5)}
    elif isinstance(part, Jumps):
        jumps = m.hints.get(f"jump:{node}", [])
        if jumps:
            tick, (_, first) = m.record.dt, jumps[0]  # counts are lost between two ticks: the later one reads all of it
            (at, _), *more = [(max(when - tick, 0.0), size / first) for when, size in jumps]
            yield (Coordinate(part.name, SIZE, abs(first)),), {"at": at, "more": tuple(more), "over": tick}
    elif isinstance(part, At):
        s = m.scale(node)
        low, high = 0.2 * part.narrow * s.span, 4.0 * part.wide * s.span
        places = [((k + 0.5) / part.places, part.wide, 1.0 / part.places) for k in range(part.places)]
        spots = [(spot, part.narrow, 2 * part.narrow) for spot in m.hints.get("spot", [])]
        for where, share, reach in places + spots:
            width = share * s.span
            place = Coordinate(part.name, PLACE, reach * s.span, -1.5, 1.5, offset=s.at(where))
            yield (place, Coordinate(part.width, SHAPE, width, np.log(low / width), np.log(high / width))), {}
    else:
        for value in part.values:
            yield (), {part.name: value * m.of(part.measure, node) if part.measure else value}


def _sprung(m: Measures) -> bool:
    """Whether it is an axis on a spring."""
    return m.record.plant == "axis" and m.base.get("k", 0.0) > 0.0
