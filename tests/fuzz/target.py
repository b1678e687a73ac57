"""What a target is, and the ways to change the inputs that it begins from."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import msgpack
import mutators

CONFIGS = Path(__file__).parents[2] / "configs"
Mutate = Callable[[Random], bytes]


class Target(NamedTuple):
    """`feed` takes an input. It may accept it or meet one of the errors that it expects; all else is a defect."""

    feed: Callable[[bytes], None]
    mutant: Mutate


class Kind(NamedTuple):
    make: Callable[[Path], Target]  # in a folder of its own
    share: float  # of all inputs; the slow ones get fewer


def of_bytes(*seeds: bytes) -> Mutate:
    """Seeds with some of their bytes changed."""
    return lambda rng: mutators.of_bytes(rng, seeds)


def of_text(*seeds: bytes) -> Mutate:
    """Texts with some bytes or some words changed."""
    return lambda rng: (mutators.of_bytes if rng.random() < 0.5 else mutators.of_text)(rng, seeds)


def of_packs(seeds: Sequence[bytes]) -> Mutate:
    """msgpack with some bytes or some values changed."""
    return _of_trees(seeds, [msgpack.unpackb(seed) for seed in seeds], _packed)


def of_json(tree: Any) -> Mutate:
    """JSON with some bytes or some values changed."""
    return _of_trees([as_json(tree)], [tree], as_json)


def as_json(tree: Any) -> bytes:
    return json.dumps(tree).encode()


def _of_trees(seeds: Sequence[bytes], trees: Sequence[Any], write: Callable[[Any], bytes]) -> Mutate:
    def mutant(rng: Random) -> bytes:
        if rng.random() < 0.5:
            return mutators.of_bytes(rng, seeds)
        return write(mutators.of_tree(rng, rng.choice(trees)))

    return mutant


def _packed(message: Any) -> bytes:
    try:
        return msgpack.packb(message, unicode_errors="surrogatepass")
    except (OverflowError, ValueError):  # larger than msgpack holds
        return b"\x80"
