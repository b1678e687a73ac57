"""Ripple, periodic in a turn: torque over the motor's angle, reading errors over the encoder's angle.

A reading error is taken as zero where the machine starts, since counters start at zero there.

Encoder on the LDU: eccentricity e of the disc on its bearing reads arctan(e cos(theta)/R_g) (11.5), a sine of amplitude
e/R_g and a third harmonic below 1e-11 rad; the stator coupling adds a second sine of the same turn (11.7), and the two
sum to one amplitude and phase. They are one term, since no record can tell them apart.

Source: Hanselman, Brushless Permanent Magnet Motor Design (2003), ch. 4 for cogging; thesis (11.5), (11.7).
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Hint, Turn
from rtctl.plants.physics.story import TURNS, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term

TURN = 2.0 * math.pi
QUARTER = 0.5 * math.pi  # rad, phase lead of the derivative of a sine
DISC = Turn("A", "phi", "one", 0.002)
BY_ORDER = ((DISC,), (DISC, Hint("order", "order")))


class CoggingSettings(Settings):
    """A, A2, A3 are the sizes: amplitudes of per_turn, 2 per_turn and 3 per_turn teeth."""

    term: Literal["ripple.cogging"] = "ripple.cogging"
    node: Node
    A: float = quantity(unit="", ge=-1e4, le=1e4, help="amplitude, Nm or N by node")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    per_turn: float = quantity(1.0, unit="", gt=0, le=1e4, help="teeth in one turn")
    A2: float = quantity(0.0, unit="", ge=-1e4, le=1e4, help="amplitude of the second harmonic")
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    A3: float = quantity(0.0, unit="", ge=-1e4, le=1e4, help="amplitude of the third harmonic")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")
    turn: float = quantity(TURN, unit="", gt=0, le=1e3, help="travel of one turn: 2 pi, or a pitch in m of a slide")


class CoggingParams(NamedTuple):
    n: float  # teeth a rad or m
    A: float
    phi: float
    A2: float
    phi2: float
    A3: float
    phi3: float


def build_cogging(settings: CoggingSettings, h: float) -> CoggingParams:
    """Nothing to discretise; a tooth that passes within two substeps is not seen."""
    s = settings
    return CoggingParams(s.per_turn * TURN / s.turn, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3)


@tick
def harmonics(x, A, phi, A2, phi2, A3, phi3):
    """A sine and two harmonics of it at the angle `x` rad, in the unit of its amplitudes."""
    return A * math.sin(x + phi) + A2 * math.sin(2.0 * x + phi2) + A3 * math.sin(3.0 * x + phi3)


@tick
def cogging(p, q):
    """Force on the node at position `q`, Nm or N, with a potential: the work over a whole tooth is 0."""
    return harmonics(p.n * q, p.A, p.phi, p.A2, p.phi2, p.A3, p.phi3)


class EncoderSettings(Settings):
    """A, A2, A3 are the sizes: reading errors once, twice, three times in a turn (or `order` times as often)."""

    term: Literal["ripple.encoder"] = "ripple.encoder"
    node: Node
    A: float = quantity(unit="", ge=-10, le=10, help="amplitude of the error, rad (m where it slides)")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    A2: float = quantity(
        0.0, unit="", ge=-10, le=10, help="amplitude of the second harmonic: an oval, or a tilted disc"
    )
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    A3: float = quantity(0.0, unit="", ge=-10, le=10, help="amplitude of the third harmonic")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")
    order: float = quantity(
        1.0, unit="", gt=0, le=1e5, help="periods in one turn; number of lines for a division error"
    )
    turn: float = quantity(TURN, unit="", gt=0, le=1e3, help="travel of one turn: 2 pi, or a pitch in m of a slide")


class EncoderParams(NamedTuple):
    n: float  # periods a rad or m
    A: float
    phi: float
    A2: float
    phi2: float
    A3: float
    phi3: float
    zero: float  # error at position 0


def build_encoder(settings: EncoderSettings, h: float) -> EncoderParams:
    """Error at position 0, which counters never show."""
    s = settings
    zero = harmonics.py_func(0.0, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3)
    return EncoderParams(s.order * TURN / s.turn, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3, zero)


@tick
def encoder(p, y):
    """Reading in rad or m for a true position of `y` rad or m."""
    return y + harmonics(p.n * y, p.A, p.phi, p.A2, p.phi2, p.A3, p.phi3) - p.zero


@tick
def shown(p, y, q, speed):
    """Reading of a position sensor, rad or m, for a true position `y`. Where `speed` is 1: reading of a speed sensor,
    rad/s or m/s, for a true speed `y` at position `q`, the rate of a position sensor's reading."""
    if speed == 0:
        return encoder(p, y)
    B, B2, B3 = p.n * p.A, 2.0 * p.n * p.A2, 3.0 * p.n * p.A3
    return y * (1.0 + harmonics(p.n * q, B, p.phi + QUARTER, B2, p.phi2 + QUARTER, B3, p.phi3 + QUARTER))


COGGING = Term(
    name="ripple.cogging",
    remedies=("feedforward",),
    words="a notchy motor: turned slowly by hand it catches at even angles",
    equation="tau = A sin(n theta + phi) + A2 sin(2 n theta + phi2) + A3 sin(3 n theta + phi3)",
    source="Hanselman 2003, ch. 4",
    settings=CoggingSettings,
    build=build_cogging,
    act={"force": "{m}.f[{i}] += {r} * ripple.cogging({p}, {r} * {m}.qm[{i}])"},
    stands=(stand("body", "driven"), stand("body", "general")),
    look_alikes={
        "load.imbalance": "turn slowly and count: imbalance comes once a turn, cogging many times",
        "ripple.reel": "the same turns at another tension: cogging stays, an eccentric reel follows the tension",
        "ripple.encoder": "slow and fast turns: the inertia hides a force in fast turns, a reading error stays",
        "structure.resonance": "two constant speeds: cogging keeps its angle, a resonance its frequency",
        "load.bump": "several turns: a tight spot is at one place, cogging everywhere",
    },
    typical={"A": (0.02, 0.3), "per_turn": (3, 48)},
    scale={"A": "force"},
    axis="angle",
    order=150,
    phrase=Phrase(
        noun="cogging",
        head="{here} is notchy",
        detail="{A}, {per_turn:g} times a turn{harmonics:words}",
        need=TURNS,
        again=" as often",
    ),
    check="Turn the motor slowly by hand with the power off and count the notches of a turn.",
    units={"A": "force", "A2": "force", "A3": "force"},
    needs=Needs(turns=0.25),
    search=(Turn("A", "phi", "force", 0.05), Hint("per_turn", "order")),
    sliding=(Turn("A", "phi", "force", 0.05), Hint("turn", "wavelength", 0.4)),
    richer=(Turn("A2", "phi2", "force", 0.02), Turn("A3", "phi3", "force", 0.02)),
    counted=("per_turn",),
    static=True,
    draws={"A": Draw(0.02, 0.3, "force"), "turn": Draw(1.0, 1.0, "turn")},
    chosen={"per_turn": (3.0, 5.0, 7.0, 12.0, 24.0)},
)
ENCODER = Term(
    name="ripple.encoder",
    remedies=("table",),
    words="a disc or coupling off centre: the reading runs ahead and behind once a turn though the shaft turns evenly",
    equation="y = theta + A sin(theta + phi) + A2 sin(2 theta + phi2) + A3 sin(3 theta + phi3)",
    source="thesis (11.5), (11.7)",
    settings=EncoderSettings,
    build=build_encoder,
    act={
        "reading": "{m}.y[{c}] = ripple.encoder({p}, {m}.y[{c}])",
        "reading:described": "{m}.y[{c}] = ripple.shown({p}, {m}.y[{c}], {r} * {m}.x[{i}], {m}.y_speed[{c}])",
    },
    stands=(
        stand("sensor", "position turns slides", usual=False),
        stand("sensor", "general position turns", ways=BY_ORDER),
        stand("sensor", "position turns"),
        stand("sensor", "general speed turns", ways=BY_ORDER),
        stand("sensor", "general position slides", usual=False),
    ),
    look_alikes={
        "ripple.capstan": "on the LDU look at both sensors: a disc off centre does not move the carriage; on the IVU "
        "change the tape's tension: a capstan out of round pulls harder, a reading error stays",
        "ripple.cogging": "slow and fast turns: a reading error does not fade with the inertia, a force does",
        "load.imbalance": "slow and fast turns: a reading error does not fade with the inertia, a force does",
        "guide.thickness": "start from another angle of the shaft: a disc errs by the angle, a strip by the place",
        "ripple.reel": "wind until the reel has another radius: a reel's wave in the capstan's angle moves with it",
        "timing.jitter": "two constant speeds: ripple stays on its angle, jitter has none and grows with speed",
    },
    typical={"A": (3e-4, 1e-2)},
    axis="angle",
    order=150,
    phrase=Phrase(
        noun="a disc off centre",
        head="the disc of {here} is off centre",
        detail="it reads up to {A} too much and too little once a turn{harmonics:words}",
        need=TURNS,
    ),
    check=(
        "Put a dial gauge on the hub of the encoder and turn it once; look at its coupling and at how its disc sits."
    ),
    units={"A": "position", "A2": "position", "A3": "position"},
    needs=Needs(turns=0.5),
    search=(DISC,),
    sliding=(Turn("A", "phi", "one", 1e-05), Hint("turn", "wavelength", 0.4, lengths=(0.0, 0.045))),
    richer=(Turn("A2", "phi2", "one", 0.0005), Turn("A3", "phi3", "one", 0.0005)),
    draws={"A": Draw(0.0003, 0.01, "lever"), "turn": Draw(1.0, 1.0, "turn")},
)
