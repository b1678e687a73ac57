"""Load-dependent dry friction: the limit grows with the tape's tension, or with the force that a contact carries.

A limit of mu |T| R at the node: mu of the contact or bearing, T in the adjacent spring, R its lever on the node. The
axis has no spring in its drive: the load is the force of the drive itself (a screw or a worm under thrust). The load
of a body of a described machine is the pull of all joints with springs that end at it, or the weight that it carries.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), section 2; Hamel, Modele de frottement a
l'entree des reducteurs, for gears under load; thesis 11.2 and 12.5 for the contacts of the linear drive.
"""

from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Size
from rtctl.plants.physics.story import Phrase
from rtctl.plants.physics.term import Node, Term

BESIDE = {"capstan": (0, 1), "reel1": (0, 0), "reel2": (1, 1), "motor1": (2, 2), "motor2": (3, 3)}  # links of the ivu

BY = ("joints", "weight")
JOINTS = (Size("mu", "one", 0.05, signed=True),)
WEIGHT = (*JOINTS, Choice("by", ("weight",)))


class LoadSettings(Settings):
    """mu is the size; negative only to correct an earlier term that is too large."""

    term: Literal["friction.load"] = "friction.load"
    node: Node
    mu: float = quantity(unit="", ge=-1.0, le=1.0, help="friction as a share of the load, at its lever")
    by: Literal["joints", "weight"] = Field(
        default="joints", description="load of a body of a described machine: its joints, or its weight"
    )


class LoadParams(NamedTuple):
    mu: float
    weight: int  # 1: by weight
    one: int  # links of the ivu whose pull presses on the node
    two: int


def build_load(settings: LoadSettings, h: float) -> LoadParams:
    """Nothing to discretise."""
    return LoadParams(settings.mu, BY.index(settings.by), *BESIDE.get(settings.node, (0, 0)))


@tick
def load_all(p, m, i):
    """Limit of dry friction at coordinate `i`, N or Nm, under the weight or all joints with springs that end there."""
    if p.weight == 1:
        return p.mu * abs(m.weight[i])
    T = 0.0
    for j in range(m.nl):
        pull = abs(linear.tension(m, j))
        if m.link_i[j] == i:
            T += abs(m.link_a[j]) * pull
        if m.link_j[j] == i:
            T += abs(m.link_b[j]) * pull
    return p.mu * T


@tick
def load(p, m, i, one, two):
    """Limit of dry friction in Nm at node `i` between the links `one` and `two`, which may be the same."""
    T = 0.5 * (lever(m, one, i) * abs(linear.tension(m, one)) + lever(m, two, i) * abs(linear.tension(m, two)))
    return p.mu * T


@tick
def lever(m, j, i):
    """Lever of link `j` on node `i`, m (or the gear ratio of a shaft)."""
    return abs(m.link_a[j]) if m.link_i[j] == i else abs(m.link_b[j])


@tick
def load_drive(p, m, i):
    """Limit of dry friction at node `i` under the force of the drives, N."""
    nq, nu = m.nq, m.nu
    F = 0.0
    for d in range(nu):
        F += m.G[nq + i, d] * m.u[d]
    return p.mu * abs(F) / m.G[nq + i, nu + i]


@tick
def pressed(p, m, i, j, k):
    """As `load`, of the links `j` and `k` where both end at node `i`, else of `j`.

    Without a link: as `load_all`; at a node where no link ends, as `load_drive`.
    """
    if j >= 0:
        return load(p, m, i, j, k if k >= 0 and (m.link_i[k] == i or m.link_j[k] == i) else j)
    ends = p.weight
    for n in range(m.nl):
        if m.link_i[n] == i or m.link_j[n] == i:
            ends = 1
    return load_all(p, m, i) if ends > 0 else load_drive(p, m, i)


LOAD = Term(
    name="friction.load",
    remedies=("feedforward", "integral"),
    words="dry friction that grows with load: the tighter the tape or the harder the push, the more it drags",
    equation="|F| <= mu |T| R",
    source="Armstrong-Helouvry 1994, section 2",
    settings=LoadSettings,
    build=build_load,
    act={
        "force": "{m}.dry[{i}] += friction_load.load_all({p}, {m}, {i})",
        "force:described": "{m}.dry[{i}] += friction_load.pressed({p}, {m}, {i}, {l}, {k})",
        "force:ldu": "{m}.dry[{i}] += friction_load.load({p}, {m}, {i}, {l}, {l})",
        "force:ivu": "{m}.dry[{i}] += friction_load.load({p}, {m}, {i}, {p}.one, {p}.two)",
        "force:axis": "{m}.dry[{i}] += friction_load.load_drive({p}, {m}, {i})",
    },
    stands=(
        stand("body", "loaded wrapped"),
        stand("body", "loaded reel"),
        stand("body", "loaded"),
        stand("body", "general sprung heavy", ways=(JOINTS, WEIGHT)),
        stand("body", "general sprung", ways=(JOINTS,)),
        stand("body", "general heavy", ways=(WEIGHT,)),
    ),
    look_alikes={
        "friction.coulomb": "the same motion at three tensions: Coulomb friction stays the same",
        "friction.viscous": "constant speeds at one tension: load friction stays flat",
        "drive.supply_sag": "pull with both motors against each other at standstill: sag needs no motion",
        "drive.gain_asymmetry": "the same load in both directions of travel: the drive's error follows its sign",
    },
    typical={"mu": (0.05, 0.3)},
    axis="tension",
    order=110,
    phrase=Phrase(
        noun="load-dependent friction",
        head="the friction of {here} depends on its load",
        detail="it {mu:grows|falls} by {mu:%} of the load",
        need="moves under several loads",
    ),
    check="Pull slowly with and without the load; look at the bearing that carries it.",
    search=JOINTS,
)
