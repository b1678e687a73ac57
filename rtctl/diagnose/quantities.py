"""Units and nouns of a recorded axis: what turns has Nm, rad and kg m^2, what slides N, m and kg.

They follow from the units of two columns, `sensors.unit` of x and `drive.unit` of u. Nothing else decides whether an
axis is rotary, and every text, table, figure and file takes its units from here.
"""

from typing import Any, NamedTuple

TURNS = ("rad",)  # units of x that make an axis rotary
EFFORT = ("N", "Nm")  # units of u that are the force or torque itself: the gain K is 1


class Quantities(NamedTuple):
    rotary: bool
    position: str
    speed: str
    force: str
    inertia: str
    stiffness: str
    drag: str  # viscous
    gain: str  # force by command
    body: str  # noun of what moves

    def of(self, parameter: str) -> str | None:
        """Unit of a parameter of the axis; None where it has none of these."""
        units = {"M": self.inertia, "K": self.gain, "F_v": self.drag, "F_c": self.force, "k": self.stiffness}
        return units.get(parameter)


def quantities(x_unit: str | None, u_unit: str | None = "V") -> Quantities:
    """Of an axis whose position is in `x_unit` (None: m) and whose command is in `u_unit`."""
    u = u_unit or "V"
    if x_unit in TURNS:
        force = "Nm"
        units = ("rad", "rad/s", force, "kg m^2", "Nm/rad", "Nm*s/rad")
        body = "the rotor"
    else:
        force = "N"
        units = ("m", "m/s", force, "kg", "N/m", "N*s/m")
        body = "the carriage"
    return Quantities(x_unit in TURNS, *units, "" if u == force else f"{force}/{u}", body)


def of_case(case: Any) -> Quantities:
    """Of a case (rtctl.diagnose.case.Case)."""
    return quantities(case.sensors.unit, case.drive.unit)
