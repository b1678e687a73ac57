"""Loop of a recorded machine: with its own law where the law is known, else with a stand-in.

The law is known where rtctl made the recording with a law of the program, or where the case declares a law. A law in a
user file that came with a recording is never run.
"""

import math
from typing import Any

import numpy as np
from pydantic import ValidationError

from rtctl.diagnose.model import owner_law
from rtctl.diagnose.model.loop import Loop, most_of, unit_of
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.stand_in import stand_in
from rtctl.diagnose.record import law
from rtctl.diagnose.record.law_params import began, law_params, law_state
from rtctl.diagnose.record.law_parts import neutral, of_settings
from rtctl.own.files import OwnError

METRES = "m"  # unit of a law whose unit is not that of its sensor


def loop_of(record: GraphRecord) -> Loop:
    """Loop of a recorded machine."""
    own = _known(record) if record.source is not None else _of_config(record) or _of_case(record)
    return own if own is not None else stand_in(record)


def _known(record: GraphRecord) -> Loop | None:
    """Loop of a machine of exchange format 1; None where its law is not known."""
    source = record.source
    assert source is not None
    if not source.closed_loop:
        return None
    p, drives, sensor = law_params(source), len(record.case.machine.drives), record.main
    known = Loop(
        p._replace(origin=0.0), law_state(began(p, source), source), sensor,
        float(record.case.machine.sensors[sensor].scale), np.eye(2)[:drives], np.zeros(drives), unit_of(record, sensor),
        source.case.drive.limit_volt or math.inf, True,
    )  # fmt: skip
    return known if abs(known.per_unit - 1.0) < 1e-9 else known._replace(unit=METRES)


def _of_config(record: GraphRecord) -> Loop | None:
    """Loop of a described machine by the config in its case; None without a config, or with a law of a user file."""
    settings = settings_of(record.case.config)
    return None if settings is None else of_machine(settings, record)


def _of_case(record: GraphRecord) -> Loop | None:
    """Loop with the law of a case of exchange format 2; None without a law. Other drives keep their command."""
    said, machine = record.case.controller, record.case.machine
    if said is None:
        return None
    sensor, drive = machine.sensors[str(said.sensor)], list(machine.drives).index(str(said.drive))
    give = np.zeros((len(machine.drives), 2))
    give[drive, 0] = 1.0
    return Loop(
        owner_law.stepped(owner_law.params(record, said), sensor), np.zeros(1, law.LAW_STATE), str(said.sensor),
        float(sensor.scale), give, np.where(give[:, 0] == 0.0, record.u[0], 0.0), unit_of(record, str(said.sensor)),
        owner_law.most(machine.drives[str(said.drive)]) or math.inf, True,
    )  # fmt: skip


def settings_of(config: dict[str, Any] | None) -> Any:
    """Checked settings of the config of a described machine, without code of the recording; None where invalid."""
    from rtctl import machines
    from rtctl.own.model import without_code

    if config is None:
        return None
    try:
        model, data = without_code(machines.class_of(config), config)
        settings = model.model_validate(data)
    except (OwnError, ValidationError):
        return None
    return settings if hasattr(settings.law.position, "kind") else None


def of_machine(settings: Any, record: GraphRecord) -> Loop:
    """Loop of a described machine with the law of its config, around a recording."""
    from rtctl.machines.described import parts_of, shares_of
    from rtctl.machines.described_plant import converter, is_counter

    parts = parts_of(settings)
    sensor = settings.machine.sensors[parts.feedback]
    counter = is_counter(sensor)
    p = of_settings(neutral(1.0 / sensor.scale, record.dt), settings.law, record.dt)
    p = p._replace(resolution=1.0 if counter else abs(sensor.grain), shift=0.0 if counter else 0.5)
    shares = shares_of(settings)
    if len(shares) == 1:
        p = p._replace(rounds=law.BOARD, output=converter(settings, 0))
    limit = min(settings.law.limit.high, most_of(settings.machine))
    give = np.column_stack([shares, np.zeros(len(shares))])
    return Loop(
        p, np.zeros(1, law.LAW_STATE), parts.feedback, float(sensor.scale), give, np.zeros(len(shares)), parts.unit,
        float(limit), True,
    )  # fmt: skip
