"""Exchange format 1 of the axis: any one mass or inertia with a drive."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rtctl.machines.exchange import Changes, Exchange, Numbers, digits, numbers
from rtctl.plants import axis as plant

TERMS = ("F_v", "F_c", "k")
EFFORT = ("N", "Nm")  # units of the command that are the force or torque itself: the gain K is 1
CAUTIOUS = 20.0  # ticks per radian at the bandwidth of the loop that replaces an unknown law


def believed(given: Mapping[str, float], drive: Any) -> Numbers:
    """Known symbols, SI. M is missing if it is not given; K, the force for one unit of the command, is missing if
    neither the parameters nor the drive give it."""
    gain = drive.newton_per_volt or drive.newton_metre_per_ampere or drive.newton_metre_per_volt
    gain = gain or (1.0 if drive.unit in EFFORT else None)
    return {**dict.fromkeys(TERMS, 0.0), **({"K": gain} if gain else {}), **given}


def carried(model: Mapping[str, float], own: Numbers, case: Any) -> Changes:
    """Changes of a config: the resolution of the sensor."""
    sensors, left = case.sensors, []
    pitch = 2 * np.pi / sensors.x_counts_per_rev if sensors.x_counts_per_rev else sensors.x_resolution_m
    changes: dict[str, Any] = {}
    if pitch:
        changes["encoder.pitch"] = digits(pitch)
    if sensors.unit not in (None, "m"):
        left.append(f"the unit of the position, {sensors.unit}: read {sensors.unit} for m throughout")
    if case.drive.unit != "V":
        left.append(f"the unit of the command, {case.drive.unit}: read {case.drive.unit} for V throughout")
    return changes, left


def stand_in(model: Mapping[str, float], dt: float) -> tuple[dict[str, Any], float]:
    """Slow cascade and its bandwidth in Hz; the law of the shipped config is for another mass."""
    w = 1.0 / (CAUTIOUS * dt)
    k_v = model["M"] * w / model["K"]
    return {"kind": "pi_velocity", "gain": digits(k_v * w / 4), "velocity_gain": digits(k_v)}, w / (8 * np.pi)


EXCHANGE = Exchange(
    parameters=plant.AxisParameters,
    terms=TERMS,
    believed=believed,
    symbols=lambda settings: numbers(settings.parameters),
    carried=carried,
    aliases={"J": "M", "K_m": "K"},  # of a rotary axis
    silent=("M", "K"),
    delay=0.0,
    stand_in=stand_in,
)
