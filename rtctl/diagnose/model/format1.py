"""Conversion of cases of exchange format 1 to described machines: parameters by symbol, sensors by fixed columns.

The three machines of exchange format 1 are descriptions that come with the program (plants/*.yaml). Their `symbols` map
a parameter of the case to numbers of the description; drives and sensors of the case override those of the description.
"""

import math
from typing import Any

import numpy as np

from rtctl.case.format1 import Case
from rtctl.case.graph_case import GraphCase
from rtctl.case.laws import NoLaw
from rtctl.case.quantities import of_case
from rtctl.diagnose.model.by_symbol import Model, owner_model
from rtctl.diagnose.model.model import GraphModel, own
from rtctl.diagnose.model.recording import MIDDLE, GraphRecord
from rtctl.diagnose.record.format1 import Record
from rtctl.diagnose.record.law_params import per_unit
from rtctl.diagnose.record.speed_sensor import noise
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import layout
from rtctl.plants.physics.place import PLANTS

FORMAT = 1
RATIOS = {"N": "R_t"}  # symbol of a ratio of two radii: the radius whose tolerance it has
SAME = 1e-12  # relative difference of two values that differ by rounding alone


def graph_record(record: Record, model: Model | None = None) -> GraphRecord:
    """Record of a format 1 bundle as a record of a described machine; its nominal model is `model`, or that of the case
    for None."""
    case = graph_case(record, model)
    sensors = {sensor.column: name for name, sensor in case.machine.sensors.items()}
    y: dict[str, np.ndarray] = {}
    grain: dict[str, float] = {}
    edges: dict[str, np.ndarray] = {}
    for column, values in record.y.items():
        name = sensors[column]
        sensor = case.machine.sensors[name]
        if not sensor.direction:
            edges[name] = np.asarray(values, float)
            continue
        counter = sensor.counts_per_unit is not None
        y[name] = (np.asarray(values, float) + (MIDDLE if counter else 0.0)) / sensor.scale
        grain[name] = abs(sensor.grain / sensor.scale)
    return GraphRecord(case, record.t, record.dt, record.ref, record.w, record.u, y, grain, None, edges, source=record)


def known_model(model: GraphModel, record: GraphRecord) -> Model:
    """Model of a machine of format 1 with parameters by symbol, as `rtctl simulate` and a config have it."""
    source = record.source
    assert source is not None
    values = own(model.base, record.name)
    owner = owner_model(source.case, source)
    found = {symbol: values[paths[0]] for symbol, paths in record.case.machine.symbols.items() if symbol in owner.base}
    said = owner.base
    kept = {s: said[s] if math.isclose(value, said[s], rel_tol=SAME) else value for s, value in found.items()}
    return owner.change(**kept).add(*model._replace(base=values).resolved().terms)


def graph_case(record: Record, model: Model | None = None) -> GraphCase:
    """Case of a format 1 bundle as a case of a described machine; `model` as for `graph_record`."""
    case = record.case
    model = owner_model(case, record) if model is None else model
    machine = described(record, model.base)
    called = {path: symbol for symbol, paths in machine.symbols.items() for path in paths}
    tolerances = {path: _tolerance(case, symbol) for path, symbol in called.items()}
    delay = case.delay_samples
    return GraphCase(
        machine=machine,
        layout=layout(machine),
        values=dict(machine.paths()),
        tolerances=tolerances,
        default_tolerance=0.0,
        physics=tuple(term.model_dump(mode="json") for term in model.terms),
        inputs={},
        problem="driven",
        delay_samples=delay,
        sample_rate=case.sample_rate,
        group="",
        per_recording=(),
        notes=case.notes,
        warnings=case.warnings,
        file=case.file,
        format=FORMAT,
        plant=case.plant,
        called=called,
        open_loop=isinstance(case.controller, NoLaw),
    )


def described(record: Record, base: dict[str, float]) -> Description:
    """Description of the machine with the nominal parameters `base`."""
    case = record.case
    data = PLANTS[case.plant].described().layout.machine.model_dump(exclude_unset=True)
    for symbol, paths in list(data["symbols"].items()):
        for path in paths:
            _put(data, path.split("."), base[symbol])
    if of_case(case).rotary:
        _turn(data)
    _drives(data, case)
    _sensors(data, record)
    return Description.model_validate(data)


def _tolerance(case: Case, symbol: str) -> float | None:
    found = case.tolerance(RATIOS.get(symbol, symbol))
    return None if np.isinf(found) else found


def _drives(data: dict[str, Any], case: Case) -> None:
    said = case.drive
    for number, drive in enumerate(data["drives"].values()):
        for key in ("bandwidth_hz", "damping", "zero", "limit", "dac_bits"):
            drive.pop(key, None)
        drive["unit"] = said.unit
        if said.amp_per_volt:
            drive["gain"] = said.amp_per_volt[number]
            if said.current_limit is not None:
                drive["output_limit"] = said.current_limit / said.amp_per_volt[number]
        if said.bandwidth_hz is not None:
            drive["bandwidth_hz"] = said.bandwidth_hz
            if said.damping is not None:
                drive["damping"] = said.damping


def _sensors(data: dict[str, Any], record: Record) -> None:
    columns = list(record.y)
    scales = per_unit(record.case)
    for number, (name, sensor) in enumerate(list(data["sensors"].items())):
        if number >= len(columns):
            del data["sensors"][name]
            continue
        sensor["column"] = columns[number]
        counts = columns[number].endswith("_counts")
        sensor.pop("counts_per_unit", None)
        if counts:
            sensor["counts_per_unit"] = float(scales[number])
        elif record.shows_speed:
            sensor["measures"] = "speed"
        else:
            sensor["resolution"] = float(resolution(record))


def resolution(record: Record) -> float:
    """Resolution of a main sensor that is no counter, m or rad: the step in the case, or the smallest recorded step.
    For a speed sensor at least the standard deviation of its noise, per s."""
    sensors = record.case.sensors
    if sensors.x_counts_per_rev:
        return float(2 * np.pi / sensors.x_counts_per_rev)
    if sensors.x_resolution_m:
        return float(sensors.x_resolution_m)
    values = next(iter(record.y.values()))
    steps = np.abs(np.diff(values))
    smallest = float(np.quantile(steps[steps > 0], 0.01)) if (steps > 0).any() else 1e-12
    return max(smallest, noise(values, record.u)) if record.shows_speed else smallest


def _turn(data: dict[str, Any]) -> None:
    """Change masses to inertias: M of a rotary axis is a moment of inertia."""
    for name, body in data["bodies"].items():
        if "mass" in body:
            body["inertia"] = body.pop("mass")
            data["symbols"] = {
                s: [p if p != f"bodies.{name}.mass" else f"bodies.{name}.inertia" for p in paths]
                for s, paths in data["symbols"].items()
            }


def _put(data: Any, path: list[str], value: float) -> None:
    for key in path[:-1]:
        data = data[key]
    data[path[-1]] = value
