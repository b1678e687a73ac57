"""Parts of the law of our own configs that a simulation of the diagnosis cannot compute."""

from typing import Any

from rtctl.diagnose.columns import measured_amplifier
from rtctl.own.files import is_own


def unsaid(settings: Any, kind: str, config: dict[str, Any]) -> tuple[str, ...]:
    """What LawParams has no place for, in words; `settings` are those of the machine, `config` its plain data."""
    has = []
    if is_own(kind):
        has.append(f"a position law of an own file, {kind}")
    sensors = getattr(settings, "sensors", None)
    if getattr(sensors, "feedback", "encoder") == "scale":
        has.append("feedback from the scale")
    elif getattr(sensors, "correction", None) is not None:
        has.append("an error table for the encoder")
    if measured_amplifier(config):
        has.append("an amplifier whose measured curve bends the command")
    return tuple(has)
