"""Runs of shipped configs in fused mode, cached for all tests."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from rtctl.cli import common
from rtctl.loop.fused import Run, run

__all__ = ["Run", "config", "run", "shipped"]
CONFIGS = Path(__file__).parents[2] / "configs"


def config(name: str, reference: str | None = None, **changes: Any) -> Any:
    """A shipped config in fused mode; `changes` are keys with __ for dots."""
    sets = [f"{key.replace('__', '.')}={json.dumps(value)}" for key, value in changes.items()]
    loaded = common.load_config(str(CONFIGS / f"{name}.yaml"), sets)
    path = None if reference is None else str(CONFIGS / "references" / f"{reference}.yaml")
    return common.with_loop(common.with_reference(loaded, path), "fused", None)


@lru_cache(maxsize=64)
def shipped(name: str, reference: str, seconds: float, **changes: Any) -> Run:
    """A shipped config with a shipped reference, run once for all tests that look at it."""
    return run(config(name, reference, **changes), seconds)
