"""The shipped machines, changed and played on virtual time, for all chapters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.config.errors import NoAnswer
from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import find, load_yaml
from rtctl.loop.fused import Run, run


def config(name: str, changes: Mapping[str, Any] | None = None) -> Any:
    """A shipped config in fused mode, with other values at dotted keys. Raises UserError for a wrong key."""
    file = find(name)
    model = machines.class_of(load_yaml(file).data)
    assert model is not None, name
    made = load_settings(file, model, widen=machines.OWN)
    return set_paths(made, {"loop.mode": "fused", **(changes or {})})


def reels(R1: float, R2: float, changes: Mapping[str, Any] | None = None) -> Any:
    """The reel unit with reels of these radii (m), for its laws and for its emulator, and other values at keys."""
    radii = {"R1": R1, "R2": R2}
    keys = {f"{place}.{name}": R for place in ("radius", "plant.parameters") for name, R in radii.items()}
    return config("ivu", {**(changes or {}), **keys})


def play(made: Any, seconds: float) -> Run:
    """A run of a config from the first tick on. Raises NoAnswer where the machine trips."""
    done = run(made, seconds)
    if done.tripped:
        raise NoAnswer(f"{made.name}: the run tripped, {done.tripped} at {done.trip_time:.3f} s")
    return done


def crossover(f: np.ndarray, S: np.ndarray) -> float:
    """Frequency in Hz at which the loop gain 1/S - 1 of a sensitivity (n,), measured at `f` (n,) Hz, falls through 1.

    Between the lines it is interpolated in the logarithm. Raises NoAnswer where it does not.
    """
    size = np.log(np.abs(1 / S - 1))
    falls = np.flatnonzero((size[:-1] >= 0) & (size[1:] < 0))
    if not falls.size:
        raise NoAnswer(f"the loop gain does not fall through 1 from {f[0]:.3g} to {f[-1]:.3g} Hz")
    i = int(falls[0])
    return float(np.exp(np.interp(0.0, -size[i : i + 2], np.log(f[i : i + 2]))))
