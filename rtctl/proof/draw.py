"""Plan of case number i of a seed: kind, plant, effects and sizes. Depends only on (seed, i, plants).

Twenty cases make a deck: five without missing physics (two plain, two with parameters at the edge of their tolerance,
one decoy), seven singles (sizes 1, 1, 1, 0.3, 0.3, 0.3, 0.1), four pairs, one triple, three unknown. Singles use every
name on every plant once before any repetition.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.proof import mechanics, unknown  # noqa: F401  (mechanics fills the table)
from rtctl.proof.effects import TABLE

DECK = (
    [("null", None)] * 2 + [("parameters", None)] * 2 + [("decoy", None)]
    + [("single", 1.0)] * 3 + [("single", 0.3)] * 3 + [("single", 0.1)]
    + [("pair", 1.0)] * 3 + [("pair", 0.3)] + [("triple", 1.0)] + [("unknown", 1.0)] * 3
)  # fmt: skip
WEIGHT = {"ivu": 0.5, "ldu": 0.3, "axis": 0.2}
NEED_SCALE = ("ripple.capstan", "guide.thickness", "sensor.scale", "sensor.rectified", "transmission.creep")
NOT_TOGETHER = ("load.imbalance", "structure.resonance", "timing.jitter", "sensor.rectified", "transmission.slip")


class Part(NamedTuple):
    name: str
    node: str
    size: float


class Plan(NamedTuple):
    kind: str
    size: float | None
    plant: str
    parts: tuple[Part, ...]
    how: str  # rich or production
    decoy: str | None


def names_on(plant: str) -> list[str]:
    return sorted(name for name, entry in TABLE.items() if entry.nodes.get(plant))


def plan(seed: int, i: int, plants: tuple[str, ...]) -> Plan:
    """Case `i`, counted from 0."""
    block, place = divmod(i, len(DECK))
    order = np.random.default_rng([seed, block, 1]).permutation(len(DECK))
    kind, size = DECK[order[place]]
    rng = np.random.default_rng([seed, i, 2])
    weight = np.array([WEIGHT[p] for p in plants])
    plant = str(rng.choice(list(plants), p=weight / weight.sum()))
    how = "production" if rng.random() < 0.15 else "rich"
    decoy = str(rng.choice(["noise_colour", "controller"])) if kind == "decoy" else None
    parts: tuple[Part, ...] = ()
    if kind == "single":
        rank = sum(DECK[k][0] == "single" for k in order[:place]) + 7 * block
        plant, name = _single(seed, rank, plants)
        parts = (_part(rng, plant, name, size),)
    elif kind in ("pair", "triple"):
        parts = _several(rng, plant, 2 if kind == "pair" else 3, size)
    elif kind == "unknown":
        names = sorted(name for name, (_, nodes) in unknown.UNKNOWN.items() if plant in nodes)
        name = names[rng.integers(len(names))]
        nodes = unknown.UNKNOWN[name][1][plant]
        parts = (Part(name, nodes[rng.integers(len(nodes))], size),)
    return Plan(kind, size, plant, parts, how, decoy)


def _single(seed: int, rank: int, plants: tuple[str, ...]) -> tuple[str, str]:
    pairs = [(plant, name) for plant in plants for name in names_on(plant)]
    pack, place = divmod(rank, len(pairs))
    return pairs[np.random.default_rng([seed, pack, 3]).permutation(len(pairs))[place]]


def _part(rng: np.random.Generator, plant: str, name: str, size: Any) -> Part:
    nodes = TABLE[name].nodes[plant]
    return Part(name, nodes[rng.integers(len(nodes))], float(size))


def _several(rng: np.random.Generator, plant: str, count: int, size: Any) -> tuple[Part, ...]:
    """Effects of different families or nodes: two of one family at one node could not be distinguished."""
    names = [n for n in names_on(plant) if n not in NOT_TOGETHER]
    found: list[Part] = []
    while len(found) < count:
        part = _part(rng, plant, names[rng.integers(len(names))], size)
        family = part.name.split(".")[0]
        if all(family != p.name.split(".")[0] and part.name != p.name for p in found):
            found.append(part)
    return tuple(found)
