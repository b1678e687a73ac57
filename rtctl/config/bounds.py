"""Bounds on the changes of a running machine's settings, in the less safe direction.

A setting declares with its field which direction is safer: `quantity(..., safer="smaller", off=0.0)`. The value in the
config at the start is the bound, unless the section `live` gives another value for that path. Changes towards the safe
side, and back to the bound, are allowed.
"""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from rtctl.config.errors import UserError
from rtctl.config.load import set_paths


class Guarded(NamedTuple):
    """Setting with a declared safer direction, and its present value."""

    path: str
    value: Any
    unit: str
    safer: str  # "smaller" or "larger"
    risk: float  # rises towards the less safe side; infinite where the limit is switched off


def guarded(settings: Any, at: str = "") -> Iterable[Guarded]:
    """Every setting of a config that declares a safer direction."""
    for name, field in type(settings).model_fields.items():
        path, value = f"{at}.{name}" if at else name, getattr(settings, name)
        if hasattr(type(value), "model_fields"):
            yield from guarded(value, path)
            continue
        extra = field.json_schema_extra
        if isinstance(extra, dict) and "safer" in extra:
            yield Guarded(path, value, str(extra.get("unit", "")), str(extra["safer"]), _risk(extra, value, settings))


def _risk(extra: dict[str, Any], value: Any, parent: Any) -> float:
    if value is None and "absent" in extra:  # None means the negative of the sibling with this name
        value = -getattr(parent, str(extra["absent"]))
    if value is None or ("off" in extra and value == extra["off"]):
        return math.inf
    return float(value) if extra["safer"] == "smaller" else -float(value)


class Bounds:
    """Bounds of a run. Raises UserError where `live` of the config names a setting without a bound."""

    def __init__(self, config: Any):
        self._most = {g.path: g for g in guarded(config)}
        for path in config.live:
            if path not in self._most:
                raise UserError(
                    f"live: {path} has no bound that could be widened; there is {', '.join(sorted(self._most))}"
                )
        for given in guarded(set_paths(config, config.live) if config.live else config):
            if given.path in config.live or given.value is None:  # None may mean a sibling in `live`
                self._most[given.path] = given

    def crossed(self, config: Any) -> dict[str, str]:
        """Settings of `config` beyond their bound: path -> message with the bound and how to allow the value."""
        out = {}
        for new in guarded(config):
            most = self._most.get(new.path)
            if most is not None and not new.risk <= most.risk:  # NaN is beyond any bound
                side = "more" if new.safer == "smaller" else "less"
                off = " and 0 switches it off" if new.risk == math.inf and new.value is not None else ""
                out[new.path] = (
                    f"{new.path} cannot become {_told(new)} while the machine runs: it may not be {side} than "
                    f"{_told(most)}{off}; to allow it write `live: {{{new.path}: {new.value}}}` into the config "
                    "and restart"
                )
        return out


def _told(setting: Guarded) -> str:
    value = setting.value
    word = "unlimited" if value is None else str(value).lower() if isinstance(value, bool) else f"{value:g}"
    return f"{word} {setting.unit}".strip()
