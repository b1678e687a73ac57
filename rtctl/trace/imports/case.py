"""case.json of an imported recording, from the plan alone."""

from pathlib import Path
from typing import Any

from rtctl.case.load import read_case
from rtctl.case.quantities import Quantities, quantities
from rtctl.config.errors import UserError
from rtctl.config.units import to_si
from rtctl.machines.profile import FREE_UNITS
from rtctl.machines.profiles import profile_of
from rtctl.trace.bundle import CASE, FORMAT, as_json
from rtctl.trace.imports.plan import Plan
from rtctl.trace.imports.table import Table


def case_of(table: Table, plan: Plan, units: dict[str, str], rate: float | None, rows: int) -> dict[str, Any]:
    """Case of an imported recording; `units` are the units of its rtctl columns. Raises UserError."""
    given = dict(plan.case)
    for key in ("sensors", "drive", "controller"):
        if not isinstance(given.get(key, {}), dict):
            raise UserError(f"--case {key}={given[key]}: it holds keys of its own, as in --case drive.limit_volt=10")
    sensors, drive = dict(given.pop("sensors", None) or {}), dict(given.pop("drive", None) or {})
    position = {name: units[name] for name in ("x", "ref", "target") if name in units}
    if len(set(position.values())) > 1:
        told = ", ".join(f"{name} in {unit}" for name, unit in position.items())
        raise UserError(f"{table.path}: {told}: position and reference should be of one kind")
    free = profile_of(plan.plant or "").has(FREE_UNITS)
    if free and position.get("x", "m") != "m":
        sensors.setdefault("unit", position["x"])
    if free and units.get("u", "V") != "V":
        drive.setdefault("unit", units["u"])
    axis = quantities(sensors.get("unit"), drive.get("unit"))
    controller = given.pop("controller", None)
    law = {"controller": controller} if controller else {"controller": {"kind": "unknown"}, "controller_known": False}
    return {
        "format": FORMAT,
        "plant": plan.plant,
        "sample_rate": rate,
        "parameters": {
            name: _parameter(plan.plant or "", name, value, axis) for name, value in plan.parameters.items()
        },
        **({"sensors": sensors} if sensors else {}),
        **({"drive": drive} if drive else {}),
        **law,
        "notes": f"Imported from {table.path.name}.",
        **given,
        "rows": rows,
        "complete": True,
    }


def checked(case: dict[str, Any], folder: Path) -> list[str]:
    """Warnings about the case. Raises UserError for an invalid case."""
    there = f"{folder / CASE}: "  # case.json is not written yet
    try:
        as_json(case)
        return [warning.removeprefix(there) for warning in read_case(case, folder).warnings]
    except UserError as error:
        raise UserError(f"{str(error).removeprefix(there)}; see --case and --parameter") from None
    except ValueError:
        raise UserError("--case: NaN and infinity are nothing that case.json can hold; write null there") from None


def _parameter(plant: str, name: str, value: float | str, axis: Quantities) -> float:
    """Parameter in SI. The check of the case reports names that the model does not have."""
    exchange = profile_of(plant).exchange
    assert exchange is not None  # checked by the plan
    field = exchange.parameters.model_fields.get(name)
    extra = field.json_schema_extra if field else None
    unit = extra.get("unit") if isinstance(extra, dict) else ""
    if profile_of(plant).has(FREE_UNITS):
        unit = axis.of(exchange.aliases.get(name, name))
    try:
        return float(to_si(value, str(unit or "")))
    except (TypeError, ValueError) as error:
        raise UserError(f"--parameter {name}={value}: {error}") from None
