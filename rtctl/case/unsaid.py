"""Parts of the law of our own configs that a simulation of the diagnosis cannot compute."""

from typing import Any

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


def measured_amplifier(config: dict) -> bool:
    """Whether the plant of our own `config` has the amplifier of 12.3."""
    plant = config.get("plant")
    amplifier = plant.get("amplifier") if isinstance(plant, dict) else None
    return isinstance(amplifier, dict) and amplifier.get("kind") == "measured"
