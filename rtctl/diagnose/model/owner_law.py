"""Law of a case of exchange format 2: its params, and whether it gives the recorded command.

The law reads the recorded column of its sensor: whole counts of a counter without wraps, the number of any other
sensor. With `units` SI the reading is divided by the column units for one SI unit; gains and reference are SI. With
`units` column reading, gains and reference are as recorded. The command is that of the drive's column, after the
drive's limit and converter.
"""

from typing import TYPE_CHECKING

import numpy as np

from rtctl.case.controller import COLUMN, GraphLaw
from rtctl.case.laws import INPUT
from rtctl.diagnose.record import law
from rtctl.diagnose.record.agreement import Agreement, agreement, disagrees
from rtctl.diagnose.record.law import LawParams
from rtctl.diagnose.record.law_parts import limited, neutral, of_case, written
from rtctl.plants.graph.description import Drive, Sensor

if TYPE_CHECKING:
    from rtctl.diagnose.model.recording import GraphRecord


def reference_scale(said: GraphLaw | None, sensors: dict[str, Sensor]) -> float:
    """Units of the recorded reference for one SI unit of the sensor that the law reads."""
    return sensors[str(said.sensor)].scale if said is not None and said.units == COLUMN else 1.0


def params(record: "GraphRecord", said: GraphLaw) -> LawParams:
    """Params of the law for the compiled step, with a reading in column units and a reference in SI."""
    machine = record.case.machine
    sensor, drive = machine.sensors[str(said.sensor)], machine.drives[str(said.drive)]
    p = limited(neutral(1.0 / sensor.scale, record.dt), most(drive), drive.step, drive.dac_range)
    p = of_case(p, said, record.dt)
    factor = reference_scale(said, machine.sensors)
    if factor == 1.0:
        return p
    first = p.sections.copy()
    for key in ("b0", "b1", "b2"):
        first[key][0] *= factor
    gain, speed = p.pi_velocity.gain, p.pi_velocity.velocity_gain
    return p._replace(
        pd=p.pd._replace(gain=factor * p.pd.gain, D=factor * p.pd.D), sections=first,
        pi_velocity=p.pi_velocity._replace(gain=factor * gain, velocity_gain=factor * speed),
    )  # fmt: skip


def most(drive: Drive) -> float | None:
    """Largest command of a drive, in its unit; None where it is unknown."""
    return drive.limit or (drive.dac_range if drive.dac_bits else None)


def stepped(p: LawParams, sensor: Sensor) -> LawParams:
    """Params of the law for a simulation, with the quantisation of the recorded sensor."""
    counter = sensor.counts_per_unit is not None
    return p._replace(resolution=1.0 if counter else abs(sensor.grain), shift=0.0 if counter else 0.5)


def recomputed(record: "GraphRecord", said: GraphLaw) -> np.ndarray | None:
    """Recomputed commands (n,) of the law from the recorded columns; None where the recording has no reference."""
    if said.sensor not in record.y or not np.isfinite(record.ref).all():
        return None
    sensor = record.case.machine.sensors[said.sensor]
    reading = sensor.scale * record.y[said.sensor]
    if sensor.counts_per_unit is not None:
        reading = np.floor(reading)  # a record has the middle of each count
    start = np.zeros(1, law.LAW_STATE)
    return np.asarray(written(params(record, said), start, record.ref, record.w, reading, 1)[:, 0])


def law_agreement(record: "GraphRecord", said: GraphLaw) -> Agreement | None:
    """Agreement of the recomputed law with the recorded command of its drive; None where it cannot be recomputed."""
    again = recomputed(record, said)
    if again is None:
        return None
    drive = list(record.case.machine.drives).index(str(said.drive))
    return agreement(again[:, None], record.u[:, [drive]])


def checked(record: "GraphRecord") -> "GraphRecord":
    """Record with its law where the law can close the loop; else without the law, with a warning that says why."""
    case, said = record.case, record.case.controller
    if said is None:
        return record
    drives = case.machine.drives
    found, why = law_agreement(record, said), ""
    others = [name for c, name in enumerate(drives) if name != said.drive and np.ptp(record.u[:, c]) > 0.0]
    if said.sensor not in record.y:
        why = f"the recording has no column '{case.machine.sensors[str(said.sensor)].column}', which the law reads"
    elif found is None:
        why = f"{disagrees(said.kind, None, '')}, which has no reference in every row"
    elif not found.holds:
        why = disagrees(said.kind, found, drives[str(said.drive)].unit)
    elif others:
        why = (
            f"the loop cannot be closed by the law '{said.kind}' alone: it commands {said.drive}, and the command of "
            f"{others[0]} changes as well"
        )
    if not why:
        return record
    warnings = (*case.warnings, f"{case.file.parent}: {why}; {INPUT}")
    return record._replace(case=case._replace(controller=None, warnings=warnings))
