"""Quantities as a person writes them: a number in SI, or a string with a unit.

pint does the conversion. It is slow to load, so it is loaded only for a unit that is new here (see factors.py), and
with the units of motion hardware alone. An angle is a dimension here and a hertz is a turn a second: 8 Hz is
50.3 rad/s, never 8 rad/s, and a gain in V is no gain in V/rad.
"""

import hashlib
import re
from functools import lru_cache
from typing import Any

from rtctl.config.factors import factor

QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
NUMBER = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"  # how a quantity starts, for JSON Schema

# Factors and small powers only: pint would also evaluate "m**9**9**9", for a very long time.
NAME = r"[A-Za-z%\u00b0\u00b5\u03bc\u03a9\u2126]+"
UNIT = re.compile(rf"(?:1(?=/))?(?:(?:^|[*/ \u00b7])\s*{NAME}(?:(?:\^|\*\*)-?\d(?!\d))?\s*){{0,8}}")
ANGLES = ("rad",)  # SI units of an angular position
LONGEST = 64  # characters of a unit

SPELLINGS = {
    **{f"{prefix}Nm": f"({prefix}N*m)" for prefix in ("", "u", "m", "k")},
    **{f"{prefix}Nms": f"({prefix}N*m*s)" for prefix in ("", "u", "m", "k")},
    **{f"{prefix}Ns": f"({prefix}N*s)" for prefix in ("", "u", "m", "k")},
    "%": "percent",
    "\u00b0": "degree",
}

# Name = value = symbol = other names. The factor of a prefix comes before its name.
DEFINITIONS = """
pico- = 1e-12 = p-
nano- = 1e-9 = n-
micro- = 1e-6 = u- = \u00b5- = \u03bc-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
meter = [length] = m = metre
second = [time] = s = sec
gram = [mass] = g
ampere = [current] = A = amp
radian = [angle] = rad
minute = 60 * second = min
hour = 60 * minute = h
day = 24 * hour = d
turn = 6.283185307179586 * radian = _ = revolution = rev = cycle
degree = 0.017453292519943295 * radian = deg
arcminute = degree / 60 = arcmin
arcsecond = degree / 3600 = arcsec
hertz = turn / second = Hz
rpm = turn / minute
newton = kilogram * meter / second ** 2 = N
joule = newton * meter = J
watt = joule / second = W
volt = watt / ampere = V
ohm = volt / ampere = _ = \u03a9 = \u2126
coulomb = ampere * second = C
farad = coulomb / volt = F
henry = volt * second / ampere = H
pascal = newton / meter ** 2 = Pa
inch = 0.0254 * meter = in
pound = 0.45359237 * kilogram = lb
ounce = pound / 16 = oz
kgf = 9.80665 * newton
gf = kgf / 1000
lbf = 4.4482216152605 * newton
ozf = lbf / 16
one = []
percent = 0.01 * one
ppm = 1e-6 * one
count = one = _ = counts
"""


EDITION = hashlib.sha256(f"{DEFINITIONS}{SPELLINGS}".encode()).hexdigest()[:16]


class UnlikeError(Exception):
    """Two units differ in dimension."""


@lru_cache(maxsize=1)
def registry() -> Any:
    """pint's registry of the units in DEFINITIONS."""
    import pint

    return pint.UnitRegistry(DEFINITIONS.strip().splitlines(), cache_folder=None)


@lru_cache(maxsize=4096)
def convert(value: float, unit: str, target: str) -> float:
    """Convert `value` from `unit` to `target`. Raises ValueError where the dimensions differ or a unit is unknown."""
    if len(unit) > LONGEST or not UNIT.fullmatch(unit.strip()):
        raise ValueError(f"'{unit[:LONGEST]}' is not a unit; expected something like {target or 'a bare number'}")
    try:
        return _tidy(float(value) * factor(unit, target, EDITION, _by_pint))
    except UnlikeError:
        raise ValueError(f"'{value:g} {unit}' is not a quantity in {target or 'bare numbers, without unit'}") from None


def _by_pint(unit: str, target: str) -> float:
    """Factor from `unit` to `target`. Raises UnlikeError for other dimensions, ValueError for an unknown unit."""
    import pint

    try:
        return float(registry().Quantity(1.0, _spell(unit)).to(_spell(target)).magnitude)
    except pint.DimensionalityError:
        raise UnlikeError from None
    except (pint.PintError, AttributeError, TypeError, ValueError, ArithmeticError) as error:
        raise ValueError(f"'{unit}' is not a unit; expected something like {target or 'a bare number'}") from error


def to_si(value: Any, unit: str) -> Any:
    """Number in `unit` from a number or a string such as "80 Hz" or "80Hz". Raises ValueError where it is neither.

    Anything but strings and booleans passes through to the type check.
    """
    if isinstance(value, bool):
        raise ValueError(f"{str(value).lower()} is not a number; write e.g. '{example(unit)}'")
    if not isinstance(value, str):
        return value
    match = QUANTITY.fullmatch(value[:200])
    if match is None:
        kind = "a number with a unit" if unit else "a number"
        raise ValueError(f"{value[:LONGEST]!r} is not {kind}; write e.g. '{example(unit)}'")
    return float(match[1]) if not match[2] else convert(float(match[1]), match[2], unit)


def example(unit: str) -> str:
    """Example of a quantity in `unit`."""
    return f"1.5 {unit}".strip()


def _spell(unit: str) -> str:
    """The unit as pint spells it; "" is a bare number."""
    if unit.strip() in ("", "1"):
        return "one"
    text = re.sub(r"\s*[ *\u00b7]\s*(?=[^\W\d]|%|\u00b0)", "*", unit.strip())
    return re.sub(NAME, lambda name: SPELLINGS.get(name[0], name[0]), text)


def _tidy(value: float) -> float:
    """5 um is 5e-06 and not 4.9999999999999996e-06: the last bit is dropped where that leaves a short number."""
    short = float(f"{value:.15g}")
    return short if len(repr(short)) < len(repr(value)) - 2 else value
