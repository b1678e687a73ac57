"""Units and nouns of an axis: Nm, rad and kg m^2 for a rotary axis, N, m and kg for a sliding axis.

They follow from the units of two columns, `sensors.unit` of x and `drive.unit` of u. Nothing else decides whether an
axis is rotary, and every text, table, figure and file takes its units from here.
"""

import re
from copy import copy
from functools import lru_cache
from typing import Any, NamedTuple

from pydantic import create_model

from rtctl.config.units import ANGLES
from rtctl.idiom import Settings
from rtctl.plants.physics.dimensions import DIMENSIONS

VOLT = "V"  # unit of a command, where none is given
TURNED = {slides: turns for turns, slides in DIMENSIONS.values()}  # unit on a sliding axis -> on a rotary one
NAMES = {"V": "volt", "A": "ampere", "N": "newton", "Nm": "newton metre"}  # unit of a command -> its noun


class Quantities(NamedTuple):
    rotary: bool
    command: str  # unit of u
    position: str
    speed: str
    force: str
    inertia: str
    stiffness: str
    drag: str  # viscous, as the plant's settings write it
    gain: str  # force per command
    body: str  # noun of the moving body

    def of(self, parameter: str) -> str | None:
        """Unit of a parameter of the axis: M, K, F_v, F_c or k; None for any other."""
        units = {"M": self.inertia, "K": self.gain, "F_v": self.drag, "F_c": self.force, "k": self.stiffness}
        return units.get(parameter)

    def needed(self) -> dict[str, str]:
        """Required parameters of a model of the axis: parameter -> noun with its unit."""
        noun, push = ("moment of inertia", "torque") if self.rotary else ("moving mass", "force")
        return {"M": f"the {noun} ({self.inertia})", "K": f"the {push} for one {self.command_name}"}

    def said(self, unit: str) -> str:
        """Unit of a setting on this axis, from its unit on a sliding axis with a command in V."""
        unit = TURNED.get(unit, unit) if self.rotary else unit
        return re.sub(r"\bV\b", self.command, unit)

    @property
    def command_name(self) -> str:
        """Noun of the command's unit: "volt"."""
        return NAMES.get(self.command, self.command)


def quantities(x_unit: str | None, u_unit: str | None = VOLT) -> Quantities:
    """Units and nouns of an axis with its position in `x_unit` (None: m) and its command in `u_unit`."""
    u, rotary = u_unit or VOLT, x_unit in ANGLES
    unit = {name: pair[not rotary] for name, pair in DIMENSIONS.items()}
    force = unit["force"]
    return Quantities(
        rotary=rotary,
        command=u,
        position=unit["position"],
        speed=unit["speed"],
        force=force,
        inertia=unit["inertia"],
        stiffness=unit["stiffness"],
        drag="Nm*s/rad" if rotary else "N*s/m",
        gain="" if u == force else f"{force}/{u}",
        body="the rotor" if rotary else "the carriage",
    )


@lru_cache
def settings_in(model: type[Settings], units: Quantities) -> type[Settings]:
    """Settings class with the fields and bounds of an axis's parameters, whose messages give the units of this axis."""
    fields: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        said, extra = copy(field), field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        said.json_schema_extra = {**extra, "unit": units.of(name) or units.said(str(extra.get("unit", "")))}
        fields[name] = (field.annotation, said)
    made: type[Settings] = create_model(model.__name__, __base__=Settings, **fields)
    return made


def of_case(case: Any) -> Quantities:
    """Units and nouns of a case of exchange format 1 (rtctl.case.format1.Case)."""
    return quantities(case.sensors.unit, case.drive.unit)
