"""Quantities to show of any machine, chosen by names and units of its signals and by the settings of its law."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

DECIMALS = {"rad": 4, "mm": 4, "V": 3, "N": 3, "A": 3}
OUTPUT = re.compile(r"u[0-9]*")
TENSION = re.compile(r"tension([0-9]*)_estimate")
STYLE = {"idle": "reverse", "armed": "black on yellow", "running": "black on green", "tripped": "bold white on red"}


class Quantity(NamedTuple):
    """One line of the table, in `unit`; None for a value that does not exist."""

    label: str
    unit: str
    measured: float
    reference: float | None = None
    error: float | None = None
    limits: tuple[float, float] | None = None


def error_name(units: Mapping[str, str]) -> str | None:
    """Name of the signal with the tracking error, such as capstan_error; None without one."""
    return next((name for name in units if name.endswith("_error") and not name.startswith("truth_")), None)


def shown(value: float, unit: str) -> tuple[float, str]:
    """Value and unit for display: metres become millimetres."""
    return (1000.0 * value, "mm") if unit == "m" else (value, unit)


def number(value: float | None, unit: str) -> str:
    """Text of a value with its sign and a fixed number of decimals for the unit."""
    if value is None:
        return ""
    text = f"{value:+.{DECIMALS.get(unit, 4)}f}"
    return text if len(text) <= 10 else f"{value:+.3e}"


def quantities(signals: Mapping[str, float], units: Mapping[str, str], law: Mapping[str, Any]) -> list[Quantity]:
    """Quantities of motion and tensions with their references, and of outputs with their limits."""
    found = []
    error = error_name(units)
    if error is not None and error in signals:
        stem = error.removesuffix("_error")
        measured = next((name for name in (stem, "x", "feedback") if name in signals), "x")
        if measured in signals and "ref" in signals:
            unit = shown(0.0, units[error])[1]
            at, ref, off = (shown(signals[name], units[error])[0] for name in (measured, "ref", error))
            found.append(Quantity(measured, unit, at, ref, off))
    for name in signals:
        if match := TENSION.fullmatch(name):
            wanted = (law.get("tension") or {}).get("F_t")
            label = f"tension {match[1]}".strip()
            found.append(Quantity(label, units.get(name, ""), signals[name], wanted))
    for name in signals:
        if OUTPUT.fullmatch(name):
            found.append(Quantity(name, units.get(name, ""), signals[name], limits=_limits(law)))
    return found


def _limits(law: Mapping[str, Any]) -> tuple[float, float] | None:
    limit = law.get("limit") or {}
    if limit.get("high") is None:
        return None
    return (-limit["high"] if limit.get("low") is None else limit["low"]), limit["high"]


def plain(status: Mapping[str, Any], units: Mapping[str, str], left: float | None = None) -> str:
    """Line of a status without control characters, for a pipe, a file or a dumb terminal."""
    t = status["signals"].get("t", 0.0)
    words = [f"{status['name']}  {t:7.1f} s  {status['state']}  {status['rate_hz']:g} Hz  missed {status['missed']}"]
    if status["mode"] == "real":
        words.append(f"late {status['late']}, p99.9 {status['lateness_us']['p999']:.0f} us")
    for q in quantities(status["signals"], units, {}):
        error = "" if q.error is None else f" error {number(q.error, q.unit)}"
        words.append(f"{q.label} {number(q.measured, q.unit)} {q.unit}{error}")
    if status["rows"].get("lost") or status["rows"]["lost_in_ring"]:
        words.append(f"{status['rows'].get('lost', 0) + status['rows']['lost_in_ring']} rows lost")
    if status["trip"]:
        words.append(f"{status['trip']['code']} at tick {status['trip']['tick']}: {status['trip']['why']}")
    if left is not None:
        words.append(f"{left:.0f} s left")
    return "  ".join(words)
