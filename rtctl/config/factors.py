"""Factors between units, kept in the cache folder.

Nearly every command reads a config with units, and loading pint takes 0.1 s. Each factor is computed once.
"""

import json
import math
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from rtctl.config.cache import cache_folder
from rtctl.config.errors import UserError
from rtctl.config.files import write_text
from rtctl.config.private import made

MOST = 2000  # factors in the file; units of imported files could fill it without end


def factor(unit: str, target: str, edition: str, work_out: Callable[[str, str], float]) -> float:
    """Factor from `unit` to `target`, from the file of this `edition` of the units, or by `work_out`.

    Raises what `work_out` raises. A folder that cannot be read or written is no error.
    """
    kept = _kept(edition)
    key = f"{unit} -> {target}"
    if key not in kept:
        kept[key] = work_out(unit, target)
        if len(kept) <= MOST:
            _keep(edition, kept)
    return kept[key]


@lru_cache(maxsize=2)
def _kept(edition: str) -> dict[str, float]:
    """Factors of earlier processes."""
    try:
        found = json.loads(_path(edition).read_text())
        return {key: value for key, value in found.items() if isinstance(value, float) and math.isfinite(value)}
    except (OSError, ValueError, AttributeError, UserError):  # not there yet, cut short, or no folder of ours
        return {}


def _keep(edition: str, kept: dict[str, float]) -> None:
    with suppress(OSError, UserError):
        path = _path(edition)
        write_text(made(path.parent) / path.name, json.dumps(kept))


def _path(edition: str) -> Path:
    return cache_folder() / f"units_{edition}.json"
