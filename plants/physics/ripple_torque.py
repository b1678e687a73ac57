"""Ripple of the torque of a motor: the gain of its drive repeats in the angle of the driven body.

With an error of commutation, or different gains of the phases, the torque for a command depends on the angle. Without
a command torque ripple is zero, unlike cogging.

Source: Jahns & Soong, Pulsating torque minimization techniques for permanent magnet AC motor drives, IEEE Trans.
Industrial Electronics 43 (1996); Hanselman, Brushless Permanent Magnet Motor Design (2003), ch. 4.
"""

from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.ripple import TURN, harmonics
from rtctl.plants.physics.search import Hint, Turn
from rtctl.plants.physics.story import TURNS, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term


class TorqueSettings(Settings):
    """A, A2, A3 are the sizes: shares of the gain, per_turn, 2 per_turn and 3 per_turn times a turn."""

    term: Literal["ripple.torque"] = "ripple.torque"
    node: Node
    A: float = quantity(unit="", ge=-0.95, le=0.95, help="amplitude, as a share of the gain")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    per_turn: float = quantity(6.0, unit="", gt=0, le=1e4, help="periods in one turn: six times the pole pairs")
    A2: float = quantity(0.0, unit="", ge=-0.95, le=0.95, help="amplitude of the second harmonic")
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    A3: float = quantity(0.0, unit="", ge=-0.95, le=0.95, help="amplitude of the third harmonic")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")
    turn: float = quantity(TURN, unit="", gt=0, le=1e3, help="travel of one turn: 2 pi, or a pitch in m of a slide")


class TorqueParams(NamedTuple):
    n: float  # periods a rad or m
    A: float
    phi: float
    A2: float
    phi2: float
    A3: float
    phi3: float


def build_torque(settings: TorqueSettings, h: float) -> TorqueParams:
    """Nothing to discretise; a period that passes within two substeps is not seen."""
    s = settings
    return TorqueParams(s.per_turn * TURN / s.turn, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3)


@tick
def torque(p, m, c, i, r):
    """Gain of drive `c` at the angle of node `i` in the middle of the substep; `r` takes the node to its own unit."""
    q = r * (m.x[i] + 0.5 * m.h * m.x[m.nq + i])
    m.volts[c] *= 1.0 + harmonics(p.n * q, p.A, p.phi, p.A2, p.phi2, p.A3, p.phi3)


TORQUE = Term(
    name="ripple.torque",
    remedies=("feedforward",),
    words="a motor that is stronger at some angles than at others: it pulses under load, and turns evenly without",
    equation="u_out = u (1 + A sin(n theta + phi) + A2 sin(2 n theta + phi2) + A3 sin(3 n theta + phi3))",
    source="Jahns & Soong 1996; Hanselman 2003, ch. 4",
    settings=TorqueSettings,
    build=build_torque,
    act={"command": "ripple_torque.torque({p}, {m}, {c}, {i}, {r})"},
    stands=(stand("drive", "general"),),
    look_alikes={
        "ripple.cogging": "run out with the power off: cogging stays, a ripple of the gain ends with the command",
        "load.imbalance": "the same turn with twice the push: imbalance stays as it is, a ripple of the gain doubles",
        "ripple.ratio": "turn by hand with the power off: a ratio is still there, a gain is not",
        "drive.gain_asymmetry": "push both ways at one angle: an asymmetry depends on the sign, a ripple on the angle",
    },
    typical={"A": (0.02, 0.2), "per_turn": (3, 42)},
    axis="angle",
    order=25,
    since=2,
    shown="turn, driven",
    phrase=Phrase(
        noun="torque ripple",
        head="{here} pushes unevenly",
        detail="its gain varies by up to {A:%}, {per_turn:g} times a turn{harmonics:words}",
        need=TURNS,
        again=" as often",
    ),
    check="Hold the shaft at several angles against one command and compare; look at the commutation offset.",
    needs=Needs(turns=0.25),
    search=(Turn("A", "phi", "one", 0.05), Hint("per_turn", "order")),
    richer=(Turn("A2", "phi2", "one", 0.02), Turn("A3", "phi3", "one", 0.02)),
    counted=("per_turn",),
    draws={"A": Draw(0.03, 0.2)},
    chosen={"per_turn": (3.0, 6.0, 12.0, 24.0)},
)
