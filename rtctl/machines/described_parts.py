"""Sensor and drive of a described machine's loop, their units, and the signals of its trace."""

from typing import Any, NamedTuple

import numpy as np

from rtctl.machines.base import COMMON_COLUMNS, Column, Signals
from rtctl.machines.described_plant import graph_of
from rtctl.machines.described_settings import drive_name, feedback_name
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.linearised import linearised, sensor_row
from rtctl.plants.graph.term_units import turns_at
from rtctl.plants.graph.units import measured_unit


class Parts(NamedTuple):
    """Sensor and drive of the loop, by names and units."""

    machine: Description
    feedback: str  # sensor
    drive: str
    unit: str  # of the feedback: rad, m, rad/s, m/s
    command: str  # unit of the command

    @property
    def is_speed(self) -> bool:
        """Whether the loop closes on a speed."""
        return self.machine.sensors[self.feedback].measures == "speed"

    @property
    def number(self) -> int:
        """Index of the drive in the description."""
        return list(self.machine.drives).index(self.drive)


def parts_of(config: Any) -> Parts:
    """Names and units of a described machine's loop."""
    machine, law = config.machine, config.law
    feedback = feedback_name(machine, law.feedback)
    assert feedback is not None  # the config has checked it
    sensor, drive = machine.sensors[feedback], drive_name(machine, law.drive)
    unit = measured_unit(sensor.measures, machine.turns(sensor.body))
    return Parts(machine, feedback, drive, unit, machine.drives[drive].unit)


def unit(config: Any) -> str:
    """Unit of reference and feedback."""
    return parts_of(config).unit


def metres_per_unit(config: Any) -> float | None:
    """Metres in one unit of the reference; None for an angle or a speed."""
    return 1.0 if parts_of(config).unit == "m" else None


def radius(config: Any) -> None:
    """Metres per radian; None, because each joint of a description has its own."""
    return None


def signals(config: Any) -> Signals:
    """Columns by which a run is judged."""
    parts = parts_of(config)
    sensor = parts.machine.sensors[parts.feedback]
    seen = f"truth_{str(sensor.body).replace('-', '_')}" + ("_speed" if parts.is_speed else "")
    outputs = tuple(drive.column for drive in parts.machine.drives.values())
    return Signals("feedback", "position_error", outputs, seen)


def columns(config: Any) -> tuple[Column, ...]:
    """Signals of the trace, with the names in the description."""
    parts = parts_of(config)
    unit, command = parts.unit, parts.command
    rate = unit if parts.is_speed else f"{unit}/s"
    return (
        *COMMON_COLUMNS,
        Column("target", unit, "reference before shaping"),
        Column("ref", unit, "reference"),
        Column("w", command, "excitation added to the controller's output"),
        *(
            Column(drive.column, drive.unit, f"command written to {name}, after limit and converter")
            for name, drive in parts.machine.drives.items()
        ),
        *(
            Column(sensor.column, _column_unit(parts.machine, sensor), f"{name}: {sensor.measures}")
            for name, sensor in parts.machine.sensors.items()
        ),
        Column("feedback", unit, f"what the loop closes on, by {parts.feedback}"),
        Column("position_error", unit, "ref - feedback"),
        Column("speed", rate, "the feedback" if parts.is_speed else "filtered difference of the feedback"),
        Column("u_c", command, "command before the limit"),
    )


def _column_unit(machine: Description, sensor: Any) -> str:
    """Unit of a sensor's column: counts, or the SI unit; "" where the column is in another unit."""
    if sensor.counts_per_unit is not None:
        return "counts"
    if sensor.per_unit != 1.0:
        return ""
    return measured_unit(sensor.measures, turns_at(machine, sensor))


def forwards(config: Any) -> float:
    """Sign of the feedback's first response to a positive command: 1 or -1."""
    parts = parts_of(config)
    _, _, p = graph_of(parts.machine, 1.0)
    A, B = linearised(p)
    c, number = sensor_row(parts.machine, p, parts.feedback), parts.number
    moment, b = c, B[:, number]
    for _ in range(len(A)):  # first derivative of the output that the command reaches
        moment = moment @ A
        reached = float(moment @ b)
        if abs(reached) > 1e-12 * float(np.abs(moment) @ np.abs(b) or 1.0):
            return 1.0 if reached > 0 else -1.0
    return 1.0


def shares_of(config: Any) -> np.ndarray:
    """Command of each drive for one unit of the law's, (drives,), with the sign that moves the feedback forwards."""
    parts, law = parts_of(config), config.law
    shares = np.array([law.shares.get(name, 0.0) for name in parts.machine.drives])
    shares[parts.number] = law.shares.get(parts.drive, 1.0)
    return np.asarray(forwards(config) * shares)
