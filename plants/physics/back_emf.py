"""Back-EMF of a drive that the nominal model takes for a source of current or torque: torque falls with speed.

A voltage V at a motor of resistance R and constant K gives the torque K (V - K v) / R: the nominal gain K / R, and a
braking torque b v with b = K^2 / R. A drive that is switched off does not brake.

Source: Krishnan, Electric Motor Drives (2001), 2.3.
"""

from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class BackEmfSettings(Settings):
    """b is the size."""

    term: Literal["drive.back_emf"] = "drive.back_emf"
    node: Node
    b: float = quantity(unit="", ge=0, le=1e5, help="braking by speed while the drive is on, Nms/rad or Ns/m by body")


class BackEmfParams(NamedTuple):
    b: float


def build_back_emf(settings: BackEmfSettings, h: float) -> BackEmfParams:
    """Nothing to discretise; stable while h b stays below the inertia."""
    return BackEmfParams(settings.b)


@tick
def back_emf(p, u, v):
    """Force on the driven body at the speed `v` under `u` volts, which are exactly zero while the drive is off."""
    return -p.b * v if u != 0.0 else 0.0


BACK_EMF = Term(
    name="drive.back_emf",
    remedies=("feedforward",),
    words="the faster it turns, the less it pushes: a voltage drive, not one that holds the current",
    equation="tau = K u - b v",
    source="Krishnan 2001, 2.3",
    settings=BackEmfSettings,
    build=build_back_emf,
    act={"force": "{m}.f[{i}] += {r} * back_emf.back_emf({p}, {m}.volts[{c}], {r} * {m}.vm[{i}])"},
    stands=(stand("drive", "general current"), stand("drive", "general force")),
    look_alikes={
        "friction.viscous": "run out with the drive switched off: friction still brakes, back-EMF does not",
        "friction.quadratic": "hold one, two and three speeds: back-EMF grows in proportion to speed",
        "drive.saturation": "a stalled start and a fast run: back-EMF takes nothing away at standstill",
    },
    typical={"b": (0.1, 1.0)},
    scale={"b": "force/speed"},
    axis="velocity",
    order=115,
    since=2,
    shown="speeds, driven",
    phrase=Phrase(
        noun="back-EMF",
        head="{here} pushes less the faster it turns",
        detail="it brakes by {b} while it is on",
        need="moves at several speeds, and a run-out with the drive switched off",
    ),
    check="Look at the amplifier's mode (voltage or current), and measure the motor's current while it runs fast.",
    units={"b": "drag"},
    search=(Size("b", "drag", 0.2),),
    seldom=3.0,
    draws={"b": Draw(0.2, 1.0, "drag")},
)
