"""Emulated machine in a user's file, from the voltages of the board to the inputs of its sensors.

    start(p, s)       at rest
    step(p, s, u)     one substep of the h in s that `build(settings, h)` was given

The emulated board counts and converts values that it reads from the state by name: see `OWN` of the plant
(plants/shown.py). Truth names of `OWN` are recorded as truth_ columns where the state has them.
"""

from rtctl.own.parts import Parts
from rtctl.plants.physics.place import PLANTS

FUNCTIONS = {"start": "start(p, s)", "step": "step(p, s, u)"}
INPUT_WORDS = {
    "u": "voltage of the board, signed, V",
    "i": "current that the amplifier is asked for, A (ldu)",
    "u1": "voltage to driver 1, V",
    "u2": "voltage to driver 2, V",
}
own_plants: dict[type, Parts] = {}  # settings class -> parts


def check_sensors(parts: Parts, machine: str) -> None:
    """Raise OwnError where the state lacks a value that this machine's sensors read."""
    sensors = PLANTS[machine].OWN.sensors
    lacking = [name for name in sensors if name not in (parts.state.names or ())]
    if lacking:
        raise parts.fault(
            parts.state_name,
            f"{parts.state_name} has no '{lacking[0]}', which a sensor of the {machine} looks at; "
            f"write {parts.state_name} = state({', '.join(f'{name}=float' for name in sensors)}, ...)",
        )
