"""Records of bench experiments on emulated machines, cached for all tests."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.cli import common
from rtctl.identify import bench
from rtctl.identify.records import Record

CONFIGS = Path(__file__).parents[2] / "configs"


def config(name: str, **changes: Any) -> Any:
    """A shipped config; `changes` are keys with __ for dots."""
    return common.load_config(
        str(CONFIGS / f"{name}.yaml"),
        [f"{key.replace('__', '.')}={json.dumps(value)}" for key, value in changes.items()],
    )


@lru_cache(maxsize=32)
def played(experiment: Any, name: str, *arguments: Any) -> Record:
    """The record of `experiment(config, *arguments)` on a shipped config."""
    return bench.play(experiment(config(name), *arguments))


def made(name: str, columns: dict[str, Any], dt: float = 0.002) -> Record:
    """A synthetic record of the given columns."""
    n = len(next(iter(columns.values())))
    given = {"t": np.arange(n) * dt, "tick": np.arange(n), **columns}
    loaded = config(name)
    return Record(loaded.machine, loaded, dt, given, "", float("nan"), "made")
