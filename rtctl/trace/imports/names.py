"""Name and unit in the title of a column: `x [mm]`, `x (mm)`, `Weg x / mm` (ISO 80000), `x in mm`."""

import re

from rtctl.config.units import convert

BRACKETS = re.compile(r"\s*(.+?)\s*(?:\[([^][]*)\]|\(([^()]*)\))\s*")
SLASH = re.compile(r"\s*(.+?)\s+/\s+(\S.*?)\s*")
IN = re.compile(r"\s*(.+?)\s+in\s+(\S+)\s*")
NO_UNIT = ("-", "1", "none", "")


def named(text: str, number: int) -> tuple[str, str | None]:
    """Name and unit of a column title; an empty name becomes `number` (from 1); the unit is None where none is given.

    After a slash or `in`, only a known unit counts. The name is then the whole title: ISO 80000 writes quantity / unit,
    and the user maps the title in the file.
    """
    if match := BRACKETS.fullmatch(text):
        unit = match[2] if match[2] is not None else match[3]
        return match[1], "" if unit.strip() in NO_UNIT else unit.strip()
    for form in (SLASH, IN):
        if (match := form.fullmatch(text)) and is_unit(match[2].strip("()")):
            return text.strip(), match[2].strip("()")
    return text.strip() or str(number + 1), None


def is_unit(text: str) -> bool:
    """Whether `text` is a known unit."""
    try:
        convert(1.0, text, text)
    except ValueError:
        return False
    return True
