"""Plan of case number i of a seed: kind, effects, sizes, and order of the topologies to try.

A deck of 60 cases: 27 singles (sizes 1, 0.3, 0.1 as 15 to 9 to 3), 7 without missing physics, 5 with parameters at the
edge of their tolerance, 3 decoys, 9 pairs, 9 of unknown physics. Singles use every name before any repetition.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.proof.machines import (  # noqa: F401  (they fill the table)
    TOPOLOGIES,
    effects_drive,
    effects_friction,
    effects_joint,
    effects_load,
    effects_sensor,
)  # fmt: skip
from rtctl.proof.machines.effect import TABLE
from rtctl.proof.machines.unknown import UNKNOWN

DECK: Sequence[tuple[str, float | None]] = (
    [("single", 1.0)] * 15 + [("single", 0.3)] * 9 + [("single", 0.1)] * 3 + [("null", None)] * 7
    + [("parameters", None)] * 5 + [("decoy", None)] * 3 + [("pair", 1.0)] * 7 + [("pair", 0.3)] * 2
    + [("unknown", 1.0)] * 9
)  # fmt: skip
DECOYS = ("noise_colour", "gust")
RARE = ("structure.compliance", "sensor.rectified")  # not in pairs: they change the structure of the machine
LATE = {"drive.lag", "sensor.lag", "timing.delay", "drive.slew"}  # two of these effects cannot be distinguished
STEADY = {"drive.offset", "load.gravity", "load.imbalance"}
DRAG = {"friction.viscous", "drive.back_emf", "friction.quadratic"}


class Plan(NamedTuple):
    kind: str
    size: float | None
    names: tuple[str, ...]
    topologies: tuple[str, ...]  # in order of trial
    how: str  # rich or production
    decoy: str | None


def plan(seed: int, i: int, topologies: tuple[str, ...] = TOPOLOGIES) -> Plan:
    """Plan of case `i`, counted from 0; depends only on the seed, `i` and `topologies`."""
    block, place = divmod(i, len(DECK))
    order = np.random.default_rng([seed, block, 101]).permutation(len(DECK))
    kind, size = DECK[order[place]]
    rng = np.random.default_rng([seed, i, 102])
    how = "production" if rng.random() < 0.2 else "rich"
    names: tuple[str, ...] = ()
    decoy = str(rng.choice(DECOYS)) if kind == "decoy" else None
    if kind == "single":
        singles = sum(k == "single" for k, _ in DECK)
        rank = sum(DECK[k][0] == "single" for k in order[:place]) + singles * block
        names = (_in_turn(seed, rank, sorted(TABLE), 103),)
    elif kind == "pair":
        names = _pair(rng)
    elif kind == "unknown":
        unknowns = sum(k == "unknown" for k, _ in DECK)
        rank = sum(DECK[k][0] == "unknown" for k in order[:place]) + unknowns * block
        names = (_in_turn(seed, rank, sorted(UNKNOWN), 104),)
    first = _in_turn(seed, i, sorted(topologies), 105)
    rest = [str(t) for t in rng.permutation(sorted(topologies)) if t != first]
    return Plan(kind, size, names, (first, *rest), how, decoy)


def _in_turn(seed: int, rank: int, names: list[str], stream: int) -> str:
    """Name number `rank` of a sequence of random permutations of `names`."""
    pack, place = divmod(rank, len(names))
    return names[np.random.default_rng([seed, pack, stream]).permutation(len(names))[place]]


def _pair(rng: np.random.Generator) -> tuple[str, str]:
    """Two names of different families that can be distinguished."""
    names = [n for n in sorted(TABLE) if n not in RARE]
    while True:
        a, b = (names[k] for k in rng.integers(len(names), size=2))
        if a.split(".")[0] != b.split(".")[0] and not any({a, b} <= group for group in (LATE, STEADY, DRAG)):
            return a, b


def needs(p: Plan) -> frozenset[str]:
    """Requirements of a plan: springs, a rigid joint, two position sensors."""
    out: frozenset[str] = frozenset()
    for name in p.names:
        if name in TABLE:
            out |= TABLE[name].need
    return out
