"""Other forms of a hypothesis: richer ones, those that differ by a setting, and the same law by another name.

A search begins with the plain form. Once that stands, the record is asked for harmonics, for a second branch, for
another shape of the same physics; and where two names of the library are one law, for the other name.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rtctl.diagnose.hypotheses import LENGTHS, SEARCH, Choice, Part, Shape, Size, Turn, Where, starts_of
from rtctl.diagnose.record import Record
from rtctl.diagnose.scales import node_scales
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.yardstick import Measures
from rtctl.plants.physics import TERMS

COUNTED, NEARLY_WHOLE = ("per_turn",), 1e-3  # slots and poles are; and how near a fit comes to them
EXTRAS: dict[str, tuple[Part, ...]] = {  # further parameters of richer forms, tried once the plain form stands
    "ripple.cogging": (Turn("A2", "phi2", "force", 0.02), Turn("A3", "phi3", "force", 0.02)),
    "ripple.encoder": (Turn("A2", "phi2", "one", 5e-4), Turn("A3", "phi3", "one", 5e-4)),
    "ripple.reel": (Turn("e2", "phi2", "one", 3e-5), Turn("e3", "phi3", "one", 3e-5)),
    "ripple.capstan": (Turn("a2", "phi2", "one", 3e-6), Turn("a3", "phi3", "one", 3e-6)),
    "guide.thickness": (Turn("A2", "phi2", "one", 1e-6), Turn("A3", "phi3", "one", 1e-6)),
    "tape.viscoelastic": (Size("c_branch2", "stiffness", 0.2), Shape("tau2", "seconds", (0.5,), 60.0)),
    "friction.asymmetry": (Size("B_a", "drag", 0.05, signed=True),),
    "friction.presliding": (
        Size("rise", "one", 0.1, most=3.0), Shape("v_s", "speed", (0.1,), 50.0),
        Shape("tau_s", "seconds", (3e-3,), 300.0), Choice("form", ("lugre",)),
    ),
    "drive.lag": (Shape("zeta", "one", (0.7,), 5.0),),
    "drive.saturation": (Shape("knee", "one", (0.15,), 6.0),),
    "drive.supply_sag": (Shape("tau", "seconds", (0.02,), 30.0),),
    "drive.thermal": (Size("ease", "one", 0.1, signed=True),),
    "structure.stiffening": (Size("c2", "square", 0.05, signed=True), Size("b2", "swell", 0.05)),
    "transmission.backlash": (Shape("edge", "one", (0.05,), 20.0),),
}  # fmt: skip
RICH_AT = {"drive.thermal": ("drive",), "transmission.backlash": ("motor", "wheel", "capstan")}  # how nodes begin
FORMS: dict[str, tuple[str, tuple[Any, ...]]] = {  # a setting that is tried in its other values once the term stands
    "friction.stribeck": ("form", ("gaussian", "exponential", "tustin")),
    "transmission.backlash": ("damping", (0.0, 1.0)),
    "drive.supply_sag": ("form", ("current", "power", "drawn")),
    "drive.deadband": ("form", ("shift", "cut", "floor")),
    "drive.saturation": ("form", ("parabola", "rapp")),
    "load.bump": ("form", ("drag", "hill", "push")),
    "drive.thermal": ("form", ("exponential", "linear", "hyperbolic")),
}
NO_SWING = 3.0  # damping of a second-order lag, whose faster half is 34 times faster by then
OTHER_NAMES = {  # of a wave that a sliding axis misreads: what its length is called, the other name, its length there
    "ripple.encoder": ("turn", "guide.thickness", "wavelength"),
    "guide.thickness": ("wavelength", "ripple.encoder", "turn"),
}


def richer(record: Record, base: dict[str, float], h: Hypothesis) -> Hypothesis | None:
    """The same hypothesis with the further parameters of its richer form; None where it has none."""
    parts = EXTRAS.get(h.term)
    if parts is None or not h.node.startswith(RICH_AT.get(h.term, ("",))):
        return None
    measures = Measures(record, base, node_scales(record, base), {})
    if is_rich(h):
        return None
    more = starts_of(h.term, h.node, parts, measures)[0]
    return h._replace(coordinates=(*h.coordinates, *more.coordinates), fixed={**h.fixed, **more.fixed})


def is_rich(h: Hypothesis) -> bool:
    """Whether it has its richer form already."""
    more = {part[0] for part in EXTRAS.get(h.term, ()) if not isinstance(part, Choice)}
    return any(c.name.partition("|")[0] in more for c in h.coordinates)


def as_harmonic(h: Hypothesis, x: np.ndarray, span: float) -> Iterator[tuple[Hypothesis, np.ndarray]]:
    """The wave of a richer form as the second and the third of a longer one, which errors that are judged on track
    show less of than of its harmonics; no longer than the `span` of its node in m, so that it comes once at least."""
    names = [c.name for c in h.coordinates]
    long = next((names.index(name) for name in LENGTHS if name in names), None)
    if long is None or not is_rich(h):
        return
    for k in (2, 3):
        coordinates, y = list(h.coordinates), h.start()
        scale = k * coordinates[long].scale
        longest = min(coordinates[long].high, float(np.log(span / scale)))
        if x[long] >= longest:
            return
        coordinates[long] = coordinates[long]._replace(scale=scale, high=longest)
        y[long] = x[long]
        first, other = names.index("A|phi"), names.index(f"A{k}|phi{k}")
        for i in (0, 1):  # cosine and sine
            y[other + i] = x[first + i] * coordinates[first].scale / coordinates[other].scale
        yield h._replace(coordinates=tuple(coordinates)), y


def forms(h: Hypothesis) -> list[Hypothesis]:
    """The same hypothesis in each of its other forms."""
    name, values = FORMS.get(h.term, ("", ()))
    default = TERMS[h.term].settings.model_fields[name].default if name else None
    return [h._replace(fixed={**h.fixed, name: v}) for v in values if v != h.fixed.get(name, default)]


def about_others(record: Record, base: dict[str, float], h: Hypothesis) -> list[Hypothesis]:
    """The same hypothesis about each other place that it may be about: beside a push that has a name of its own, what
    was taken for the middle of the travel may be the start."""
    parts = tuple(part for part in SEARCH.get(h.term, ()) if isinstance(part, Where))
    if not parts:
        return []
    rest = {name: value for name, value in h.fixed.items() if name not in {part.name for part in parts}}
    measures = Measures(record, base, node_scales(record, base), {})
    tried = (h._replace(fixed={**rest, **other.fixed}) for other in starts_of(h.term, h.node, parts, measures))
    return [other for other in tried if other.fixed != h.fixed]


def moved_into(form: Hypothesis, x: np.ndarray) -> list[np.ndarray]:
    """Starts of another form at x of the first: as it is, and what took one flank of a hill for a bump by itself is
    moved aside."""
    if form.fixed.get("form") != "hill":
        return [x]
    names = [c.name for c in form.coordinates]
    force, at = names.index("F"), names.index("at")
    starts = [x]
    for side in (-1.0, 1.0):  # it pushes on behind its middle and back before it
        y = x.copy()
        y[at] += side * form.values(x)["width"] / form.coordinates[at].scale
        y[force] *= -side
        starts.append(y)
    return starts


def rounded(h: Hypothesis, x: np.ndarray) -> tuple[int, Hypothesis] | None:
    """The same hypothesis with its order at the whole number that it is next to at x, and which coordinate it loses by
    that; None where it has no order or one in between."""
    for i, c in enumerate(h.coordinates):
        order = c.scale * float(np.exp(x[i])) if c.name in COUNTED else 0.0
        if order > 0.5 and abs(order / round(order) - 1.0) < NEARLY_WHOLE:
            rest = (*h.coordinates[:i], *h.coordinates[i + 1 :])
            return i, h._replace(coordinates=rest, fixed={**h.fixed, c.name: float(round(order))})
    return None


def of_first_order(h: Hypothesis, x: np.ndarray) -> tuple[Hypothesis, np.ndarray] | None:
    """The first-order lag that a second-order one comes to at x where it is damped far beyond any swing, and its x;
    None for anything else."""
    names = [c.name for c in h.coordinates]
    if h.fixed.get("order") != 2 or "zeta" not in names or h.values(x)["zeta"] < NO_SWING:
        return None
    zeta, y = names.index("zeta"), np.array(x)
    y[names.index("tau")] *= 2.0 * h.values(x)["zeta"]  # (s tau)^2 + 2 zeta s tau + 1, where s is small
    rest = tuple(c for i, c in enumerate(h.coordinates) if i != zeta)
    return h._replace(coordinates=rest, fixed={**h.fixed, "order": 1}), np.delete(y, zeta)


def renamed(h: Hypothesis, x: np.ndarray) -> Hypothesis | None:
    """The same law by its other name, at the same x: a wave that a sliding axis misreads is of its screw or encoder, or
    of its guide, and at lengths that both may have nothing tells them apart. None where it has no other name."""
    own, other, name = OTHER_NAMES.get(h.term, ("", "", ""))
    if h.node != "sensor" or own not in (c.name for c in h.coordinates):
        return None
    shortest, longest = LENGTHS[name]
    if not shortest < h.values(x)[own] < longest:
        return None
    coordinates = tuple(c._replace(name=name) if c.name == own else c for c in h.coordinates)
    return h._replace(term=other, coordinates=coordinates)
