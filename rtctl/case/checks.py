"""Checks of the values in a case: numbers, objects, and unknown keys."""

import math
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from rtctl.config.complaints import sentences
from rtctl.config.errors import UserError, nearest

FROM_ELSEWHERE = ("config", "seed", "versions", "run", "timing", "changes", "rows", "losses", "complete",
                  "recorded_at", "part", "parts", "repaired", "discarded_bytes", "recording_error")  # fmt: skip


class Part(BaseModel):
    """Object of a case; unknown keys are left out."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)


def part(where: Path, name: str, model: type, given: Any, warnings: list[str]) -> Any:
    """Checked object under a key. Raises UserError that names the key."""
    if given is None:
        given = {}
    if not isinstance(given, dict):
        raise UserError(f"{where}: {name} is a {type(given).__name__}; it should be an object {{...}}")
    warnings += [strange(where, k, name + ".", model.model_fields) for k in given if k not in model.model_fields]  # type: ignore[attr-defined]
    if name == "reaches":
        for key, value in given.items():
            number(where, f"reaches.{key}", value)
    try:
        return model(**given)
    except ValidationError as error:
        raise UserError(sentences(error, model, given, lambda path: f"{where}: {name}").splitlines()[0]) from None


def number(where: Path, key: str, value: Any) -> float | None:
    """Finite number under a key; None where there is none. Raises UserError."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UserError(f"{where}: {key} is {value!r}; it should be a finite number in SI units")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise UserError(f"{where}: {key} is {value}; it should be a finite number")
    return found


def sample_rate(where: Path, case: dict[str, Any]) -> float | None:
    """Sample rate of a case, Hz; None where the clock is uneven. Raises UserError where it is not positive."""
    rate = number(where, "sample_rate", case.get("sample_rate"))
    if rate is not None and rate <= 0:
        raise UserError(f"{where}: sample_rate is {rate:g}; it should be above 0 Hz, or null where the clock is uneven")
    return rate


def delay_samples(where: Path, case: dict[str, Any]) -> float | None:
    """Delay of the commands of a case, samples; None where it is missing. Raises UserError where it is out of range."""
    delay = number(where, "delay_samples", case.get("delay_samples"))
    if delay is not None and not 0 <= delay <= 100:
        raise UserError(f"{where}: delay_samples is {delay:g}; it should be between 0 and 100")
    return delay


def strange(where: Path, name: str, before: str, known: Any) -> str:
    """Warning text for an unknown key."""
    return f"{where}: {before}{name} is not a key that this program knows; it is left out" + perhaps(
        nearest(name, known)
    )


def perhaps(hint: str | None) -> str:
    """Text with the key that may have been meant; empty without a hint."""
    return f" (is it '{hint}'?)" if hint else ""
