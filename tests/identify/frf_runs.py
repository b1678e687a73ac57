"""Runs for frequency responses, cached for all tests, and synthetic records."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.cli import common
from rtctl.config.load import set_path
from rtctl.identify import best_linear, experiment
from rtctl.identify.records import Record, take
from rtctl.loop import fused

CONFIGS = Path(__file__).parents[2] / "configs"


def config(name: str = "ivu", **changes: Any) -> Any:
    """A shipped config in fused mode; `changes` are keys with __ for dots."""
    loaded = common.with_loop(common.load_config(str(CONFIGS / f"{name}.yaml"), []), "fused", None)
    for key, value in changes.items():
        loaded = set_path(loaded, key.replace("__", "."), value)
    return loaded


def reels(R1: float, R2: float, **parameters: float) -> Any:
    """Settings of the reel unit with the given radii (laws and emulator) and plant parameters."""
    return config(plant__parameters={"R1": R1, "R2": R2, **parameters}, radius={"source": "given", "R1": R1, "R2": R2})


@lru_cache(maxsize=32)
def _noise(key: str) -> tuple[Record, ...]:
    name, options = json.loads(key)
    return tuple(take(fused.run(e.config, e.seconds)) for e in experiment.noise(config(name), **options))


def noise(name: str = "ivu", **options: Any) -> list[Record]:
    """Records of `experiment.noise` on a shipped config."""
    return list(_noise(json.dumps([name, options], sort_keys=True)))


def play(made: Any, **options: Any) -> list[Record]:
    """Records of `experiment.multisine` on a config."""
    return [take(fused.run(e.config, e.seconds)) for e in experiment.multisine(made, **options)]


@lru_cache(maxsize=32)
def shipped(name: str = "ivu", motor: int = 1) -> tuple[Record, ...]:
    """Records of `experiment.multisine` on a shipped config."""
    return tuple(play(config(name), motor=motor))


@lru_cache(maxsize=32)
def response(name: str = "ivu", motor: int = 1) -> best_linear.BestLinear:
    """Best linear approximation of a shipped config."""
    return best_linear.identify(list(shipped(name, motor)))


def made_up(
    u: np.ndarray, y: np.ndarray, w: np.ndarray, excitation: dict[str, Any], rate: float = 1000.0, speed: float = 0.01
) -> Record:
    """Synthetic record of the axis at `speed` m/s with superposed `y`."""
    made = set_path(set_path(config("axis"), "excitation", excitation), "loop.rate", rate)
    n = len(u)
    t = np.arange(n) / rate
    columns = {"t": t, "tick": np.arange(n), "ref": speed * t, "x": speed * t + y, "u": u, "u_c": u, "w": w}
    return Record("axis", made, 1 / rate, columns, "", float("nan"), "made up")
