"""Guide errors: position errors of a carriage by the strip or rail on which it rolls.

    e = e_sys + e_l + e_s   (11.9)

of which e_l is here; e_sys is ripple.capstan, ripple.encoder and sensor.scale, e_s is transmission.slip and creep.
On the LDU the position of the carriage deviates from that by the capstan's angle, and only the scale shows it.
An error is taken as zero where the machine starts.

Source: thesis 11.1, (11.6), (11.9); figure 11.7 for wavelengths of 150 and 300 mm.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.ripple import harmonics
from rtctl.plants.physics.search import INF, Hint, Shape, Size, Turn
from rtctl.plants.physics.story import PASSES, WAVES, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term


class ThicknessSettings(Settings):
    """A, A2, A3 are the sizes: once, twice, three times in a wavelength."""

    term: Literal["guide.thickness"] = "guide.thickness"
    node: Node
    A: float = quantity(unit="m", ge=-1e-2, le=1e-2, help="amplitude of the position error")
    wavelength: float = quantity(0.15, unit="m", gt=1e-4, le=1e2, help="wavelength along the guide")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at position 0")
    A2: float = quantity(0.0, unit="m", ge=-1e-2, le=1e-2, help="amplitude at half the wavelength")
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    A3: float = quantity(0.0, unit="m", ge=-1e-2, le=1e-2, help="amplitude at a third of the wavelength")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")


class ThicknessParams(NamedTuple):
    A: float
    n: float  # rad/m
    phi: float
    A2: float
    phi2: float
    A3: float
    phi3: float
    zero: float


def build_thickness(settings: ThicknessSettings, h: float) -> ThicknessParams:
    """Error at position 0, which counters never show."""
    s = settings
    zero = harmonics.py_func(0.0, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3)
    return ThicknessParams(s.A, 2.0 * math.pi / s.wavelength, s.phi, s.A2, s.phi2, s.A3, s.phi3, zero)


@tick
def thickness(p, x):
    """Position error at `x` m, m."""
    return harmonics(p.n * x, p.A, p.phi, p.A2, p.phi2, p.A3, p.phi3) - p.zero


class StripSettings(Settings):
    """longer is the size: 1e-5 is a strip 0.1 mm up and down over 100 mm, (pi y / wavelength)^2."""

    term: Literal["guide.strip"] = "guide.strip"
    node: Node
    longer: float = quantity(unit="", ge=0, le=0.02, help="share by which the path is longer than a straight one")
    wavelength: float = quantity(0.1, unit="m", gt=1e-4, le=1e2, help="wavelength of the strip")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at position 0")


class StripParams(NamedTuple):
    longer: float
    n: float  # rad/m, of twice the wave
    phi: float
    zero: float


def build_strip(settings: StripSettings, h: float) -> StripParams:
    """Integral of the path at position 0."""
    n = 4.0 * math.pi / settings.wavelength
    return StripParams(settings.longer, n, 2.0 * settings.phi, math.sin(2.0 * settings.phi) / n)


@tick
def strip(p, x):
    """Position less length of the path (11.6) at `x` m, m.

    For y = Y sin(k x + phi) the path has sqrt(1 + y'^2) = 1 + y'^2/2 to a share of (k Y)^2/4, below 2 percent here;
    its integral is x + longer (x + sin(2 k x + 2 phi)/2k) with longer = (k Y)^2/4.
    """
    return -p.longer * (x + math.sin(p.n * x + p.phi) / p.n - p.zero)


class DirtSettings(Settings):
    """A is the size."""

    term: Literal["guide.dirt"] = "guide.dirt"
    node: Node
    A: float = quantity(unit="m", ge=-1e-2, le=1e-2, help="largest position error")
    at: float = quantity(unit="m", ge=-100, le=100, help="position of the middle")
    width: float = quantity(1e-3, unit="m", gt=1e-6, le=10, help="standard deviation of the bell")


class DirtParams(NamedTuple):
    A: float
    at: float
    width: float
    zero: float


def build_dirt(settings: DirtSettings, h: float) -> DirtParams:
    """Error at position 0, which counters never show."""
    s = settings
    return DirtParams(s.A, s.at, s.width, s.A * math.exp(-0.5 * (s.at / s.width) ** 2))


@tick
def dirt(p, x):
    """Position error at `x` m, m."""
    d = (x - p.at) / p.width
    return p.A * math.exp(-0.5 * d * d) - p.zero


THICKNESS = Term(
    name="guide.thickness",
    remedies=("table",),
    words="a strip or rail of uneven thickness: the carriage is a little off, in waves along the guide",
    equation="e = A sin(n x + phi) + A2 sin(2 n x + phi2) + A3 sin(3 n x + phi3) less that at 0, n = 2 pi / wavelength",
    source="thesis 11.1, figure 11.7",
    settings=ThicknessSettings,
    build=build_thickness,
    moves=True,
    act={"reading": "{m}.y[{c}] += guide.thickness({p}, {m}.y[{c}])"},
    stands=(
        stand("body", "guided"),
        stand("sensor", "guided load", again=True),
        stand("sensor", "guided lone"),
    ),
    look_alikes={
        "ripple.capstan": "lift the carriage, turn the capstan half a turn and repeat: only the capstan's wave moves",
        "ripple.encoder": "start from another angle of the shaft: a disc errs by the angle, a strip by the place",
        "load.bump": "the same travel seen by both sensors: thickness shows as a difference, a bump in both",
        "sensor.scale": "travel over several wavelengths: a scale error grows, waves do not",
        "guide.strip": "travel over several wavelengths: the path along a wavy strip grows, thickness does not",
        "guide.dirt": "several wavelengths of travel: dirt is at one place, thickness everywhere",
    },
    typical={"A": (2e-6, 5e-4), "wavelength": (0.02, 0.3)},
    axis="position",
    order=160,
    phrase=Phrase(
        noun="uneven thickness",
        head="the guide at {here} is uneven",
        detail="{A} in waves of {wavelength}",
        need=WAVES,
    ),
    check="Measure the thickness of the strip or rail every few millimetres with a micrometer.",
    needs=Needs(
        compared=True,
        alone="slides",
    ),
    search=(Turn("A", "phi", "one", 5e-06), Hint("wavelength", "wavelength", 0.6, lengths=(0.012, INF))),
    richer=(Turn("A2", "phi2", "one", 1e-06), Turn("A3", "phi3", "one", 1e-06)),
    draws={"A": Draw(2e-06, 3e-05), "wavelength": Draw(0.2, 1.0, "travel")},
)
STRIP = Term(
    name="guide.strip",
    remedies=("table",),
    words="a wavy strip: the way along it is longer than the straight line",
    equation="l = integral of sqrt(1 + y'(x)^2) dx",
    source="thesis (11.6)",
    settings=StripSettings,
    build=build_strip,
    moves=True,
    act={"reading": "{m}.y[{c}] += guide.strip({p}, {m}.y[{c}])"},
    stands=(
        stand("body", "guided"),
        stand("sensor", "guided load", again=True),
        stand("sensor", "guided lone"),
    ),
    look_alikes={
        "sensor.scale": "look for the waves on top of the trend, two to each wave of the strip: a scale error has none",
        "guide.thickness": "travel over several wavelengths: the path along a wavy strip grows, thickness does not",
    },
    typical={"longer": (1e-6, 1e-4), "wavelength": (0.05, 0.3)},
    axis="position",
    order=160,
    phrase=Phrase(
        noun="a wavy strip",
        head="the strip at {here} is wavy",
        detail="the path along it is {longer:%} longer than a straight one, in waves of {wavelength}",
        need=WAVES,
    ),
    check="Lay a straight edge along the strip and look for gaps; look at its tension and its supports.",
    draws={"longer": Draw(1e-05, 0.0001), "wavelength": Draw(0.2, 1.0, "travel")},
)
DIRT = Term(
    name="guide.dirt",
    remedies=("table",),
    words="dirt on the strip: at one place the carriage is a little off, before and behind it is right",
    equation="e = A exp(-((x - at)/width)^2 / 2)",
    source="thesis 11.1",
    settings=DirtSettings,
    build=build_dirt,
    moves=True,
    act={"reading": "{m}.y[{c}] += guide.dirt({p}, {m}.y[{c}])"},
    stands=(
        stand("body", "guided"),
        stand("sensor", "guided load", again=True),
        stand("sensor", "guided lone"),
    ),
    look_alikes={
        "load.bump": "the same travel seen by both sensors: dirt shows as a difference of the two, a bump in both",
        "guide.thickness": "several wavelengths of travel: dirt is at one place, thickness everywhere",
        "sensor.missed_counts": "pass the place ten times: dirt comes back to zero error, lost counts add up",
    },
    typical={"A": (5e-6, 5e-5), "width": (5e-4, 5e-3)},
    axis="position",
    order=160,
    phrase=Phrase(
        noun="dirt on the strip",
        head="there is dirt on the strip at {here}",
        detail="it is {A} off at {at:3}, within {width}",
        need=PASSES,
    ),
    check="Wipe the strip at the place and repeat the pass.",
    needs=Needs(compared=True),
    search=(
        Size("A", "one", 1e-05, signed=True),
        Hint("at", "spot", 0.05, True),
        Shape("width", "span", (0.02,), 10.0),
    ),
    draws={"A": Draw(5e-06, 5e-05), "at": Draw(0.02, 0.08, "travel"), "width": Draw(0.005, 0.02, "travel")},
)
