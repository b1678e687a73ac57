"""SI format of numbers: few significant figures, an SI prefix, a unit."""

import math

PREFIXES = {-9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M"}
PREFIXED = ("Nm", "N", "V", "s", "Hz", "m", "rad", "A", "m/s", "rad/s", "N/m", "Nm/rad", "Nms/rad", "Ns/m")
LARGE = ("N/m", "Nm/rad", "Hz")  # units that take kilo and mega


def nice(value: float, unit: str = "", digits: int = 2) -> str:
    """Number in SI format with a prefix: nice(0.0031, "Nm") is "3.1 mNm"."""
    if not math.isfinite(value):
        return "any size" if value > 0 else "unknown"
    power = prefix(value, unit, digits)
    return f"{figures(value / 10.0**power, digits)} {PREFIXES[power]}{unit}".rstrip()


def prefix(value: float, unit: str, digits: int = 2) -> int:
    """Power of ten of the SI prefix of a size; 0 for units without a prefix."""
    if unit not in PREFIXED or value == 0 or not math.isfinite(value):
        return 0
    rounded = float(f"{abs(value):.{max(digits, 2) - 1}e}")
    power = 3 * math.floor(math.log10(rounded) / 3 + 1e-12)
    if unit in ("rad/s", "Hz", "m/s") and rounded >= 0.1:  # 300 mHz is unusual
        power = max(power, 0)
    return min(max(power, -9), 6 if unit in LARGE else 0)


def figures(x: float, digits: int) -> str:
    """Number with `digits` significant figures, without an exponent from 1e-4 to 1e7."""
    if x == 0:
        return "0"
    x = float(f"{x:.{digits - 1}e}")
    size = math.floor(math.log10(abs(x)) + 1e-12)
    if not -4 <= size <= 6:
        return f"{x:.{digits - 1}e}"
    return f"{x:.{max(digits - 1 - size, 0)}f}"


def both(a: float, b: float, unit: str = "") -> tuple[str, str]:
    """Two sizes in SI format, with as many figures, up to four, as distinguish the sizes."""
    for digits in (2, 3, 4):
        one, two = nice(a, unit, digits), nice(b, unit, digits)
        if one != two:
            break
    return one, two


def span(low: float, high: float, unit: str = "") -> str:
    """Interval with one prefix: span(-0.0047, 0.00024, "m") is "-4.7 to 0.24 mm"."""
    power = prefix(max(abs(low), abs(high)), unit)
    ends = (figures(x / 10.0**power, 2) for x in (low, high))
    return f"{' to '.join(ends)} {PREFIXES[power]}{unit}".rstrip()


def percent(share: float) -> str:
    """Share in per cent, as "3.4 %"."""
    return f"{figures(100 * share, 2)} %"
