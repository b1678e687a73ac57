"""Common functions of bench experiments: changes of a config, and its run on virtual time into a record.

Each experiment is a pure function on a record or on arrays. Experiments with a motion of their own have a function that
returns the config to play: `play` runs it in this process, `rtctl run` on a bench.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path, set_paths
from rtctl.identify.records import Record, take
from rtctl.machines.profile import REELS
from rtctl.machines.profiles import kinds_with, profile_of

ARMING = {"given": 1.0, "measured": 14.0}  # s, by the source of the radii
REST = 0.5  # s, after the end of the reference


def changed(config: Any, changes: Mapping[str, Any]) -> Any:
    """Config with `changes` at dotted keys; the excitation is off unless `changes` sets it.

    Raises UserError for an unknown key or a value out of bounds.
    """
    return set_paths(config, {"excitation": {"kind": "none"}, **changes})


def need(machine: str, name: str, *traits: str) -> None:
    """Raise UserError where a kind of machine has none of the traits (machines/profile.py)."""
    if not profile_of(machine).traits.intersection(traits):
        raise UserError(f"{name}: this experiment is for {' and '.join(kinds_with(*traits))}, not for {machine}")


def seconds(config: Any) -> float:
    """Duration in s of a config from the first tick to the end of its reference."""
    reference, end, at = config.reference, 0.0, 0.0
    for step in reference.steps:
        end, at = step.at + (abs(step.to - at) / step.ramp if step.ramp else 0.0), step.to
    if reference.knots:
        end = reference.knots[-1][0]
    return end + REST + arming(config)


def arming(config: Any) -> float:
    """Longest time in s until the reference starts."""
    return ARMING[config.radius.source if profile_of(config.kind).has(REELS) else "given"]


def play(config: Any, length: float | None = None) -> Record:
    """Play a config in this process on virtual time for `length` s, by default until its reference has ended.

    Raises NoAnswer where the machine trips, with the time; UserError where settings contradict each other.
    """
    from rtctl.loop import fused

    try:
        run = fused.run(set_path(config, "loop.mode", "fused"), seconds(config) if length is None else length)
    except ValueError as error:
        raise UserError(f"{config.name}: {error}") from error
    return whole(take(run))


def whole(record: Record) -> Record:
    """The record unchanged. Raises NoAnswer with the time where the machine tripped."""
    if record.trip:
        raise NoAnswer(f"{record.source}: the run tripped, {record.trip} at {record.trip_time:.3f} s")
    return record


def ramps(t: np.ndarray, ref: np.ndarray, least: float) -> list[tuple[int, int]]:
    """Row intervals [begin, end) of at least `least` s in which the reference `ref` (n,) has constant speed."""
    slope = np.diff(ref) / np.diff(t)
    fastest = np.abs(slope).max(initial=0.0)
    if fastest == 0.0:
        return []
    breaks = np.flatnonzero(np.abs(np.diff(slope)) > 1e-6 * fastest) + 1
    edges = np.concatenate(([0], breaks, [len(slope)]))
    return [(int(a), int(b)) for a, b in pairwise(edges) if abs(slope[a]) > 1e-4 * fastest and t[b - 1] - t[a] >= least]


def counts_per_turn(record: Record) -> int:
    """Counts per turn of the encoder on the capstan."""
    found = profile_of(record.kind).encoder
    assert found is not None
    encoder = found(record.config)
    return int(encoder.lines * encoder.multiply)
