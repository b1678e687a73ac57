"""Ripple of reel and capstan: an eccentric reel, and a capstan out of round.

A wheel of radius R + e cos(q + phi) has wound or passed  R q + e (sin(q + phi) - sin(phi))  after an angle q. The
second part stretches the tape, and the tape pulls at the changed lever. Both follow from one potential, so the work of
the spring over a whole turn is 0. The error is zero where the machine starts.

On the LDU an eccentric or out-of-round capstan moves the carriage by the integral (11.3). The relative change of its
lever and force is e/R_c, below one part in a thousand, and is left out.

Source: Shelton, Dynamics of web tension control with velocity or torque control (1986); thesis (11.3), (11.4).
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.ripple import harmonics
from rtctl.plants.physics.search import Turn
from rtctl.plants.physics.story import TURNS, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term


class ReelSettings(Settings):
    """e, e2, e3 are the sizes: the radius is R + e cos(q + phi) + e2 cos(2 q + phi2) + e3 cos(3 q + phi3)."""

    term: Literal["ripple.reel"] = "ripple.reel"
    node: Node
    e: float = quantity(unit="m", ge=-0.02, le=0.02, help="eccentricity")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    e2: float = quantity(0.0, unit="m", ge=-0.02, le=0.02, help="second harmonic: an oval")
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    e3: float = quantity(0.0, unit="m", ge=-0.02, le=0.02, help="third harmonic: a triangle")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")


class CapstanSettings(Settings):
    """a, a2, a3 are the sizes: the way is off by a sin(theta + phi) + a2 sin(2 theta + phi2) + ..."""

    term: Literal["ripple.capstan"] = "ripple.capstan"
    node: Node
    a: float = quantity(unit="m", ge=-5e-3, le=5e-3, help="amplitude of the travel: the eccentricity of the capstan")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    a2: float = quantity(0.0, unit="m", ge=-5e-3, le=5e-3, help="second harmonic: half the radius deviation of an oval")
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    a3: float = quantity(0.0, unit="m", ge=-5e-3, le=5e-3, help="third harmonic")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")


class WheelParams(NamedTuple):
    a: float  # m, of the way
    phi: float
    a2: float
    phi2: float
    a3: float
    phi3: float
    zero: float  # m, way at angle 0


def build_reel(settings: ReelSettings, h: float) -> WheelParams:
    """The way is the integral of the radius over the angle."""
    s = settings
    return wheel(s.e, s.phi, 0.5 * s.e2, s.phi2, s.e3 / 3.0, s.phi3)


def build_capstan(settings: CapstanSettings, h: float) -> WheelParams:
    """Nothing to discretise."""
    s = settings
    return wheel(s.a, s.phi, s.a2, s.phi2, s.a3, s.phi3)


def wheel(a: float, phi: float, a2: float, phi2: float, a3: float, phi3: float) -> WheelParams:
    """The way at angle 0 filled in."""
    return WheelParams(a, phi, a2, phi2, a3, phi3, harmonics.py_func(0.0, a, phi, a2, phi2, a3, phi3))


@tick
def way(p, q):
    """Tape or travel beyond R q at angle `q`, m."""
    return harmonics(q, p.a, p.phi, p.a2, p.phi2, p.a3, p.phi3) - p.zero


@tick
def arm(p, q):
    """Radius beyond R at angle `q`, m: the slope of `way`."""
    return p.a * math.cos(q + p.phi) + 2.0 * p.a2 * math.cos(2.0 * q + p.phi2) + 3.0 * p.a3 * math.cos(3.0 * q + p.phi3)


@tick
def tape_of(m, i):
    """The link that starts at reel `i`."""
    for j in range(m.nl):
        if m.link_i[j] == i:
            return j
    return 0


@tick
def reel(p, m, i, j):
    """Extend the tape `j` of reel `i` by the winding error of the reel."""
    linear.extend(m, j, way(p, m.qm[i]), arm(p, m.qm[i]) * m.vm[i])


@tick
def reel_arm(p, m, i, j):
    """Torque of tape `j` at the lever error of reel `i`, with the tension after slip and slack."""
    m.f[i] -= arm(p, m.qm[i]) * linear.tension(m, j)


@tick
def spans(p, m, i, j, k):
    """Move the spans `j` and `k` around capstan `i` by its error of travel; no spans where `k` is below 0."""
    if k >= 0:
        moved, speed = way(p, m.qm[i]), arm(p, m.qm[i]) * m.vm[i]
        for n in (j, k):
            linear.extend(m, n, linear.side(m, n, i) * moved, linear.side(m, n, i) * speed)


@tick
def spans_arm(p, m, i, j, k):
    """As `reel_arm`."""
    if k >= 0:
        for n in (j, k):
            m.f[i] -= arm(p, m.qm[i]) * linear.side(m, n, i) * linear.tension(m, n)


@tick
def rolled(p, m, i, c):
    """Move the reading `c` of the body that rolls on capstan `i`; no reading where `c` is below 0."""
    if c >= 0:
        m.y[c] += way(p, m.x[i])


@tick
def capstan(p, m, i):
    """Move both tapes by the error of travel of capstan `i`: tape 1 gets shorter and tape 2 longer."""
    moved, speed = way(p, m.qm[i]), arm(p, m.qm[i]) * m.vm[i]
    linear.extend(m, 0, -moved, -speed)
    linear.extend(m, 1, moved, speed)


@tick
def capstan_arm(p, m, i):
    """As `reel_arm`."""
    m.f[i] += arm(p, m.qm[i]) * (linear.tension(m, 0) - linear.tension(m, 1))


REEL = Term(
    name="ripple.reel",
    remedies=("feedforward",),
    words="a reel off centre: once a turn it pulls the tape taut and lets it go again",
    equation="l = R q + e (sin(q + phi) - sin(phi)), arm R + e cos(q + phi)",
    source="Shelton 1986",
    settings=ReelSettings,
    build=build_reel,
    act={
        "force": "ripple_tape.reel({p}, {m}, {i}, ripple_tape.tape_of({m}, {i}))",
        "force:described": "ripple_tape.reel({p}, {m}, {i}, {l})",
        "last": "ripple_tape.reel_arm({p}, {m}, {i}, ripple_tape.tape_of({m}, {i}))",
        "last:described": "ripple_tape.reel_arm({p}, {m}, {i}, {l})",
    },
    stands=(stand("body", "reel"),),
    look_alikes={
        "load.imbalance": "the same turns at another tension: an eccentric reel follows the tension, a weight does not",
        "ripple.cogging": "the same turns at another tension: an eccentric reel follows the tension, cogging does not",
        "ripple.encoder": "wind until the reel has another radius: a reel's wave in the capstan's angle moves with it",
        "ripple.capstan": "count the waves over ten turns of the reel: only the reel's own wave fits a whole number",
    },
    typical={"e": (5e-5, 5e-4)},
    axis="angle",
    order=40,
    phrase=Phrase(
        noun="a reel off centre",
        head="{here} is off centre",
        detail="by {e} once a turn{harmonics:words}",
        need=TURNS,
    ),
    check="Turn the reel slowly past a pointer and see how far its rim moves; look at its seat on the shaft.",
    needs=Needs(turns=0.5),
    search=(Turn("e", "phi", "one", 0.0001),),
    richer=(Turn("e2", "phi2", "one", 3e-05), Turn("e3", "phi3", "one", 3e-05)),
    draws={"e": Draw(5e-05, 0.0005)},
)
CAPSTAN = Term(
    name="ripple.capstan",
    remedies=("feedforward", "table"),
    words="a capstan out of round or off its bearings: once a turn it moves a little too much and too little",
    equation="x = R_c theta + a (sin(theta + phi) - sin(phi))",
    source="thesis (11.3), (11.4)",
    settings=CapstanSettings,
    build=build_capstan,
    act={
        "force:described": "ripple_tape.spans({p}, {m}, {i}, {l}, {k})",
        "last:described": "ripple_tape.spans_arm({p}, {m}, {i}, {l}, {k})",
        "reading:described": "ripple_tape.rolled({p}, {m}, {i}, {c})",
        "force:ivu": "ripple_tape.capstan({p}, {m}, {i})",
        "last:ivu": "ripple_tape.capstan_arm({p}, {m}, {i})",
        "reading:ldu": "{m}.y[1] += ripple_tape.way({p}, {m}.x[{i}])",
    },
    moves=True,
    stands=(stand("body", "capstan"),),
    look_alikes={
        "ripple.encoder": "on the LDU both give the same difference of the sensors, and only in closed loop does the "
        "carriage itself follow the encoder; on the IVU change the tension: only a capstan out of round pulls harder",
        "guide.thickness": "lift the carriage, turn the capstan half a turn and repeat: only the capstan's wave moves",
        "ripple.reel": "count the waves over ten turns of the capstan: only its own wave fits a whole number",
        "load.imbalance": "turn without tape: imbalance is still there",
    },
    typical={"a": (2e-6, 2e-4)},
    axis="angle",
    order=40,
    phrase=Phrase(
        noun="a capstan out of round",
        head="{here} is out of round",
        detail="by {a} once a turn{harmonics:words}",
        need=TURNS,
    ),
    check="Put a dial gauge on the capstan and turn it once; look at its bearings and at dirt on its rim.",
    needs=Needs(turns=0.5),
    search=(Turn("a", "phi", "one", 1e-05),),
    richer=(Turn("a2", "phi2", "one", 3e-06), Turn("a3", "phi3", "one", 3e-06)),
    draws={"a": Draw(1e-05, 0.0001)},
)
