"""Quantities as a person writes them: a number in SI, or a string with a unit.

pint does the conversion. It takes a third of a second to load, so it is loaded only when a string needs it.
"""

from functools import lru_cache
from typing import Any

SPELLINGS = {"Nm": "N*m", "mNm": "mN*m", "Nms": "N*m*s", "turn/s": "turn/s", "ohm": "ohm", "%": "percent", "um": "micrometer"}


@lru_cache(maxsize=1)
def registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=4096)
def convert(value: float, unit: str, target: str) -> float:
    """Convert `value` from `unit` to `target`. Raises ValueError where the dimensions differ or a unit is unknown."""
    import pint

    try:
        return float(registry().Quantity(value, _spell(unit)).to(_spell(target)).magnitude)
    except pint.DimensionalityError:
        raise ValueError(f"'{value:g} {unit}' is not a quantity in {target}") from None
    except (pint.UndefinedUnitError, AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"'{unit}' is not a unit; expected something like {target}") from error


def to_si(value: Any, unit: str) -> Any:
    """Number in `unit` from a number or a string such as "80 Hz". Anything else passes through to the type check."""
    if not isinstance(value, str):
        return value
    number, _, suffix = value.strip().partition(" ")
    try:
        magnitude = float(number)
    except ValueError:
        raise ValueError(f"'{value}' is not a number with a unit; write e.g. '1.5 {unit}' with a space between") from None
    return magnitude if not suffix.strip() else convert(magnitude, suffix.strip(), unit)


def _spell(unit: str) -> str:
    if unit in ("", "1"):
        return "dimensionless"
    parts = unit.split("/")
    return "/".join(SPELLINGS.get(part, part) for part in parts)
