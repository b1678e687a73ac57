"""Law of a described machine as the `law` of a config: the law of its case, else a stand-in."""

from typing import Any

import numpy as np

from rtctl.case.controller import GraphLaw
from rtctl.case.laws import CascadeLaw, PdLaw
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.owner_law import params
from rtctl.diagnose.model.recording import GraphRecord, levers
from rtctl.diagnose.model.stand_in import stand_in_law
from rtctl.laws import sections


def played_law(record: GraphRecord) -> dict[str, Any]:
    """Law of a record as plain data of a config, SI; a stand-in where a config cannot hold the law of the case."""
    said = record.case.controller
    position = None if said is None else _position(record, said)
    if said is None or position is None:
        return stand_in_law(record)
    return {"feedback": said.sensor, "drive": said.drive, "position": position}


def _position(record: GraphRecord, said: GraphLaw) -> dict[str, Any] | None:
    """Position law of a config, whose output moves the feedback forwards; None where a config cannot hold it."""
    p = params(record, said)
    body = record.case.machine.sensors[str(said.sensor)].body
    sign = float(np.sign(levers(nominal(record.case), str(body))[str(said.drive)]))
    if isinstance(said, PdLaw):
        gain, D = sign * p.pd.gain, sign * p.pd.D
        if gain <= 0.0 or D < 0.0:
            return None
        corner = {} if said.derivative_filter_hz is None else {"derivative_filter": said.derivative_filter_hz}
        return {"kind": "pd", "gain": gain, "tau_d": D / gain, **corner}
    if isinstance(said, CascadeLaw):
        gain, speed = sign * p.pi_velocity.gain, sign * p.pi_velocity.velocity_gain
        return None if min(gain, speed) < 0.0 else {"kind": "pi_velocity", "gain": gain, "velocity_gain": speed}
    if not sign or p.n_sections > sections.MOST:
        return None
    rows = [{name: float(row[name]) for name in ("b0", "b1", "b2", "a1", "a2")} for row in p.sections[: p.n_sections]]
    rows[0] |= {name: sign * rows[0][name] for name in ("b0", "b1", "b2")}
    return {"kind": "sections", "sections": [{"kind": "biquad", **row} for row in rows]}
