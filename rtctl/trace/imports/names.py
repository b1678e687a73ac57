"""Name and unit in the title of a column: `x [mm]`, `x (mm)`, `Weg x / mm` (ISO 80000), `x in mm`."""

import re

from rtctl.config.units import convert

BRACKETS = re.compile(r"\s*(.+?)\s*(?:\[([^][]*)\]|\(([^()]*)\))\s*")
SLASH = re.compile(r"\s*(.+?)\s+/\s+(\S.*?)\s*")
IN = re.compile(r"\s*(.+?)\s+in\s+(\S+)\s*")
NO_UNIT = ("-", "1", "none", "")


def named(text: str, number: int) -> tuple[str, str | None]:
    """Name and unit of a title; the number of the column, from 1, where it is empty; None where no unit is given.

    After a slash and after `in` only a unit that is known counts. The whole title is the name then: ISO 80000 writes
    quantity / unit, and an owner maps what the file shows.
    """
    if match := BRACKETS.fullmatch(text):
        unit = match[2] if match[2] is not None else match[3]
        return match[1], "" if unit.strip() in NO_UNIT else unit.strip()
    for form in (SLASH, IN):
        if (match := form.fullmatch(text)) and is_unit(match[2].strip("()")):
            return text.strip(), match[2].strip("()")
    return text.strip() or str(number + 1), None


def is_unit(text: str) -> bool:
    """Whether it is a unit that is known."""
    try:
        convert(1.0, text, text)
    except ValueError:
        return False
    return True
