"""Parts of a config's law that the simulation of a diagnosis cannot compute."""

from typing import Any

from rtctl.own.files import is_own


def unsaid(settings: Any, kind: str, config: dict[str, Any]) -> tuple[str, ...]:
    """Names of law parts that LawParams cannot hold; `settings` are the machine's settings, `config` its plain data."""
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
    """Whether the plant of a `config` has the amplifier with the measured curve (12.3)."""
    plant = config.get("plant")
    amplifier = plant.get("amplifier") if isinstance(plant, dict) else None
    return isinstance(amplifier, dict) and amplifier.get("kind") == "measured"
