"""Runs of the shipped machines on virtual time with changed settings, for all chapters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.config.errors import NoAnswer
from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import find, load_yaml
from rtctl.loop.fused import Run, run


def config(name: str, changes: Mapping[str, Any] | None = None) -> Any:
    """Shipped config in fused mode with `changes` at dotted keys. Raises UserError for an unknown key."""
    file = find(name)
    model = machines.class_of(load_yaml(file).data)
    assert model is not None, name
    made = load_settings(file, model, widen=machines.OWN)
    return set_paths(made, {"loop.mode": "fused", **(changes or {})})


def reels(R1: float, R2: float, changes: Mapping[str, Any] | None = None) -> Any:
    """Config of the reel unit with reel radii in m for law and emulator, and `changes` at dotted keys."""
    radii = {"R1": R1, "R2": R2}
    keys = {f"{place}.{name}": R for place in ("radius", "plant.parameters") for name, R in radii.items()}
    return config("ivu", {**(changes or {}), **keys})


def play(made: Any, seconds: float) -> Run:
    """Run of a config from the first tick. Raises NoAnswer where the machine trips."""
    done = run(made, seconds)
    if done.tripped:
        raise NoAnswer(f"{made.name}: the run tripped, {done.tripped} at {done.trip_time:.3f} s")
    return done


def crossover(f: np.ndarray, S: np.ndarray) -> float:
    """Crossover frequency in Hz: the loop gain 1/S - 1 of a sensitivity (n,) at `f` (n,) in Hz falls through 1.

    Interpolates in the logarithm between lines. Raises NoAnswer without a crossover.
    """
    size = np.log(np.abs(1 / S - 1))
    falls = np.flatnonzero((size[:-1] >= 0) & (size[1:] < 0))
    if not falls.size:
        raise NoAnswer(f"the loop gain does not fall through 1 from {f[0]:.3g} to {f[-1]:.3g} Hz")
    i = int(falls[0])
    return float(np.exp(np.interp(0.0, -size[i : i + 2], np.log(f[i : i + 2]))))
