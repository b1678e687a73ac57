"""Parts of the law of our own configs that `controller` of case.json, the exchange format's law, has no key for."""

from typing import Any


def beyond_format(config: Any) -> tuple[str, ...]:
    """What the law of a config has, in words, that no key of `controller` can say."""
    law = config.get("law") if isinstance(config, dict) else None
    if not isinstance(law, dict):
        return ()
    part = {k: v if isinstance(v, dict) else {} for k, v in law.items()}
    has = []
    if config.get("machine") == "ivu":
        if part.get("friction"):
            has.append("friction compensation that passes from motor to motor with speed")
        if part.get("gain_schedule", {}).get("mode", "off") != "off":
            has.append("a gain schedule")
        if part.get("inertia", {}).get("share") != 0:  # on where the config does not say
            has.append("inertia feedforward from the shaped reference")
        has.append("tension that is ramped up and follows the radii")
        if part.get("allocation", {}).get("floor") is not None:
            has.append("a floor of the tension voltage")
    else:
        if part.get("friction"):
            has.append("friction compensation")
        if part.get("position", {}).get("kind") == "pi_velocity":
            has.append("feedback of a filtered speed with anti-windup")
        if part.get("inertia", {}).get("volts"):
            has.append("computed torque from the shaped reference")
        sensors = config.get("sensors") or {}
        if config.get("machine") == "ldu" and sensors.get("feedback") == "scale":
            has.append("feedback from the scale")
        if sensors.get("correction"):
            has.append("an error table for the encoder")
    if part.get("limit", {}).get("slew") is not None:
        has.append("a slew limit")
    return tuple(has)
