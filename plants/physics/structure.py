"""Structure: a mass on a spring that the model lacks, and springs that stiffen as they bend.

The mass m hangs on a node by a spring of its own frequency f_Hz (with the node held) and damping zeta:

    m x_a'' = -k (x_a - x) - b (x_a' - x'),   F = -m x_a'',   k = m (2 pi f_Hz)^2,   b = 4 pi zeta m f_Hz

The total inertia at the node grows by m: a base inertia that was fitted with the mass on it must come down by as much.
Over a substep the node moves at its middle speed, the relative motion of the mass is free, and its 2 by 2 step is
exact. The force on the node is minus the change of the mass's momentum over the substep, so that momentum is conserved
to rounding. Second order; stable while 2 pi f_Hz h stays below 0.7 with a mass as large as the node's own.

Source: Den Hartog, Mechanical vibrations (1956), ch. 3; Kovacic & Brennan, The Duffing equation (2011), ch. 1;
Elliott, Ghandchi Tehrani & Langley, Nonlinear damping and quasi-linear modelling, Phil. Trans. R. Soc. A 373 (2015);
thesis 12.3, for the print heads' resonances between 50 and 220 Hz.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics import second_order
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term


class ResonanceSettings(Settings):
    """mass is the size."""

    term: Literal["structure.resonance"] = "structure.resonance"
    node: Node
    f_Hz: float = quantity(unit="", gt=0.1, le=5e3, help="natural frequency with the node held, Hz")
    mass: float = quantity(unit="", ge=0, le=1e3, help="attached mass, kg or kg m^2 by node")
    zeta: float = quantity(0.02, unit="", ge=0, lt=1, help="damping ratio")


class ResonanceParams(NamedTuple):
    mass_h: float  # mass over substep
    h: float
    a11: float  # of the step of relative position and speed
    a12: float
    a21: float
    a22: float


RESONANCE_STATE = state(x=float, v=float)


def build_resonance(settings: ResonanceSettings, h: float) -> ResonanceParams:
    """Exact step of the free mass over `h` s."""
    w = 2.0 * math.pi * settings.f_Hz
    zeta = min(max(settings.zeta, 0.0), 0.999)
    to_x, v_to_x, x_to_v, to_v = second_order.transition(w * h, zeta)
    return ResonanceParams(settings.mass / h, h, to_x, v_to_x / w, x_to_v * w, to_v)


@tick
def resonance(p, s, x, v):
    """Force on a node that is at `x` with speed `v` at the middle of the substep."""
    way = s.x - (x - 0.5 * p.h * v)
    rate = s.v - v
    s.x = x + 0.5 * p.h * v + p.a11 * way + p.a12 * rate
    before = s.v
    s.v = v + p.a21 * way + p.a22 * rate
    return -p.mass_h * (s.v - before)


class StiffeningSettings(Settings):
    """c3 is the size. With c2 the spring is stiffer one way than the other, with b2 it loses more where it bends. With
    another power the stiffness grows, and never falls, by that power of the bend; at `bend` it is that of the cubic."""

    term: Literal["structure.stiffening"] = "structure.stiffening"
    node: Node
    c3: float = quantity(
        unit="", ge=-1e15, le=1e15, help="cubic stiffness, N/m^3 or Nm/rad^3 by link; negative softens"
    )
    c2: float = quantity(
        0.0, unit="", ge=-1e12, le=1e12, help="quadratic stiffness, N/m^2 or Nm/rad^2 by link; 0: symmetric"
    )
    b2: float = quantity(
        0.0, unit="", ge=0, le=1e12, help="damping that grows with the bend squared, Ns/m^3 or Nms/rad^3 by link"
    )
    power: float = quantity(2.0, unit="", ge=0.5, le=6, help="exponent of the bend in the stiffness")
    bend: float = quantity(1.0, unit="", gt=0, le=1e3, help="bend at which c3 is that of the cubic, m or rad by link")


class StiffeningParams(NamedTuple):
    c3: float
    c2: float
    b2: float
    power: float
    bend: float


def build_stiffening(settings: StiffeningSettings, h: float) -> StiffeningParams:
    """Nothing to discretise; stable while h sqrt(3 c3 e^2 / mass) stays below one."""
    c3 = settings.c3 if settings.power == 2.0 else max(settings.c3, 0.0)
    return StiffeningParams(c3, settings.c2, settings.b2, settings.power, settings.bend)


@tick
def stiffening(p, e, v):
    """Pull at elongation `e` and its rate `v`, in addition to the linear spring and damper."""
    if p.power == 2.0:
        return (p.c2 + p.c3 * e + p.b2 * v) * e * e
    return p.c3 * p.bend * p.bend * (abs(e) / p.bend) ** p.power * e + (p.c2 + p.b2 * v) * e * e


RESONANCE = Term(
    name="structure.resonance",
    remedies=("notch", "feedforward"),
    words="something on it shakes: a mass on a spring that rings at its own frequency",
    equation="m x_a'' = -k (x_a - x) - b (x_a' - x'), F = -m x_a''",
    source="Den Hartog 1956; thesis 12.3",
    settings=ResonanceSettings,
    build=build_resonance,
    act={"force": "{m}.f[{i}] += {r} * structure.resonance({p}, {s}, {r} * {m}.qm[{i}], {r} * {m}.vm[{i}])"},
    stands=(stand("body"),),
    look_alikes={
        "timing.delay": "a sweep through the frequency: a resonance has a dip and a peak, a delay only lags",
        "drive.lag": "a sweep through the frequency: the gain of a lag only falls, it has no peak",
        "tape.viscoelastic": "let go and listen: a relaxing tape does not ring",
        "ripple.cogging": "two speeds: ripple moves with the speed, a resonance stays at its frequency",
    },
    typical={"f_Hz": (20.0, 220.0), "mass": (0.1, 1.0), "zeta": (0.01, 0.1)},
    scale={"mass": "inertia"},
    axis="frequency",
    order=80,
    state=RESONANCE_STATE,
    phrase=Phrase(
        noun="a resonance",
        head="something on {here} shakes",
        detail="{mass} rings at {f_Hz:3}",
        need="excitation up to the resonance",
    ),
    check="Knock on the part and listen; look for a loose screw, a cable or a cover that can swing.",
    units={"f_Hz": "Hz"},
    search=(
        Size("mass", "inertia", 0.1),
        Shape("f_Hz", "ring", (3.0, 6.0, 11.0, 19.0, 30.0, 43.0, 60.0, 85.0, 120.0, 165.0, 225.0), 1.4),
        Shape("zeta", "one", (0.02,), 30.0),
    ),
    stiff=True,
    draws={"f_Hz": Draw(0.04, 0.2, "rate"), "mass": Draw(0.1, 0.4, "inertia"), "zeta": Draw(0.01, 0.1)},
)
STIFFENING = Term(
    name="structure.stiffening",
    remedies=("joint",),
    words="a spring that grows stiffer the further it bends",
    equation="T = c e + k e' + c2 e^2 + c3 e^3 + b2 e^2 e'; or c3 bend^2 (|e| / bend)^power e",
    source="Kovacic & Brennan 2011; Elliott, Ghandchi Tehrani & Langley 2015",
    settings=StiffeningSettings,
    build=build_stiffening,
    act={
        "force": "linear.pull({m}, {l}, structure.stiffening({p}, linear.stretch({m}, {l}), "
        "linear.stretch_rate({m}, {l})))"
    },
    stands=(stand("joint", "spring"),),
    look_alikes={
        "tape.viscoelastic": "the same load slowly and fast: stiffening does not depend on the speed",
        "transmission.backlash": "small motions about the middle: a gap is loose there, a cubic spring is linear",
        "load.spring": "sweep at two amplitudes: only with the cubic does the resonance move",
    },
    typical={"c3": (0.1, 1.0)},
    scale={"c3": "stiffness/stretch^2"},
    axis="position",
    order=80,
    phrase=Phrase(
        noun="a nonlinear spring",
        head="the spring at {here} grows {c3:stiffer|softer} as it bends",
        detail="its cubic stiffness is {c3:+}",
        need="large deflections",
    ),
    check=(
        "Push with one, two and three times a force and measure the deflection; look at clearances "
        "that close under load."
    ),
    needs=Needs(stiffness=True),
    search=(Size("c3", "cubic", 0.2, signed=True), Shape("bend", "twist", (1.0,), fixed=True)),
    richer=(Size("c2", "square", 0.05, signed=True), Size("b2", "swell", 0.05)),
    variants=Choice("power", (2.0, 1.0, 4.0)),
    stiff=True,
    draws={"c3": Draw(1.0, 5.0, "cubic")},
)
