"""Numbers of a described machine by dotted path in a case: tolerances, and values that differ between recordings."""

from pathlib import Path
from typing import Any

from rtctl.case.checks import number
from rtctl.config.errors import UserError, nearest

DEFAULT_TOLERANCE = 0.15  # relative tolerance of a value, where the case gives none


def tolerances(
    where: Path, given: Any, values: dict[str, float], warnings: list[str]
) -> tuple[dict[str, float | None], float | None]:
    """Relative tolerances by dotted path, and the tolerance of all other values; None is unlimited.

    Raises UserError where a share is no number of 0 or more. A path without a value is a warning.
    """
    if given is None:
        warnings.append(f"{where}: tolerance is missing; {DEFAULT_TOLERANCE} is taken for every value")
        return {}, DEFAULT_TOLERANCE
    if not isinstance(given, dict):
        raise UserError(f"{where}: tolerance is a {type(given).__name__}; it should be an object of paths and shares")
    out: dict[str, float | None] = {}
    for path, share in given.items():
        found = number(where, f"tolerance.{path}", share)
        if found is not None and found < 0.0:
            raise UserError(f"{where}: tolerance.{path} is {found:g}; it should be 0 or more, or null")
        out[path] = found
        known = any(one == path or one.startswith(f"{path}.") for one in values)
        if path != "default" and not known and not path.startswith("physics."):
            hint = nearest(path, values)
            near = f" (is it '{hint}'?)" if hint else ""
            warnings.append(f"{where}: tolerance.{path} names no value of the machine; it is left out{near}")
    return out, out.pop("default", DEFAULT_TOLERANCE)


def per_recording(where: Path, given: Any, values: dict[str, float]) -> tuple[str, ...]:
    """Paths under the key `per_recording`, whose values differ between recordings. Raises UserError."""
    if given is None:
        return ()
    if not isinstance(given, list) or not all(isinstance(path, str) for path in given):
        raise UserError(f"{where}: per_recording should be a list of dotted paths, such as bodies.load.mass")
    out: list[str] = []
    for path in given:
        found = [one for one in values if one == path or one.startswith(f"{path}.")]
        if not found:
            hint = nearest(path, values)
            raise UserError(
                f"{where}: per_recording: there is no value {path}" + (f"; did you mean '{hint}'?" if hint else "")
            )
        out += found
    return tuple(dict.fromkeys(out))
