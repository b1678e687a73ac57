"""The law of a described machine: `controller` of exchange format 2, checked.

The law reads one sensor and commands one drive, both by their names in the description. Its steps are those of exchange
format 1. An incomplete law is no error: the recorded command is then the input, and a warning says why.

Source: docs/bring_your_own_machine.md.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from rtctl.case.checks import Part, part, perhaps
from rtctl.case.laws import INPUT, CascadeLaw, NoLaw, PdLaw, SectionsLaw, UnknownLaw, kind_of
from rtctl.config.errors import UserError, nearest
from rtctl.plants.graph.description import Description

READ = ("position", "speed")  # quantities of a body that a law can read, in order of preference
COLUMN = "column"  # units of reference and gains


class Wired(Part):
    """Sensor and drive of a law."""

    sensor: str | None = None
    drive: str | None = None
    units: Literal["SI", "column"] = "SI"  # of reference and gains: SI, or those of the sensor's column


class WiredPd(PdLaw, Wired):
    """PD law between a sensor and a drive."""


class WiredSections(SectionsLaw, Wired):
    """Biquads between a sensor and a drive."""


class WiredCascade(CascadeLaw, Wired):
    """Cascade of position and speed between a sensor and a drive."""


GraphLaw = WiredPd | WiredSections | WiredCascade
KINDS: dict[str, type[GraphLaw]] = {"pd": WiredPd, "sections": WiredSections, "cascade_p_v": WiredCascade}


def controller(
    where: Path, case: Mapping[str, Any], machine: Description, problem: str, warnings: list[str]
) -> GraphLaw | NoLaw | UnknownLaw:
    """Law of a case with its sensor and drive, NoLaw for an open-loop command, UnknownLaw for any other.

    Raises UserError that names the key and what would be right. A law that cannot be used adds to `warnings`.
    """
    known, given = case.get("controller_known"), case.get("controller")
    if known is not None and not isinstance(known, bool):
        raise UserError(f"{where}: controller_known is {known!r}; it should be true or false")
    kind = "unknown" if given is None else kind_of(where, given)
    if kind == NoLaw().kind:
        return NoLaw()
    model = KINDS["sections"] if given and given.get("sections") is not None else KINDS.get(kind)
    why = ""
    if model is None:
        if known or kind != UnknownLaw().kind:
            why = f"a law of kind '{kind}' cannot be recomputed; it should be {_listed(KINDS)}"
    elif known is not False and problem != "driven":
        why = f"in a {problem} problem no law commands a drive"
    elif known is not False:
        law = part(where, "controller", model, given, warnings)
        sensor, no_sensor = _sensor(where, machine, law)
        drive, no_drive = _drive(where, machine, law)
        why = no_sensor or no_drive
        if not why:
            wired: GraphLaw = law.model_copy(update={"sensor": sensor, "drive": drive})
            return wired
    if why:
        warnings.append(f"{where}: controller: {why}; {INPUT}")
    return UnknownLaw(kind=kind)


def _sensor(where: Path, machine: Description, law: Wired) -> tuple[str, str]:
    """Sensor that a law reads and "", or "" and the reason why there is none."""
    can = {n: s.measures for n, s in machine.sensors.items() if s.body and s.direction and s.measures in READ}
    if isinstance(law, CascadeLaw):
        can = {name: measures for name, measures in can.items() if measures == READ[0]}
    if law.sensor is None:
        found = next((same for m in READ if (same := [n for n, measures in can.items() if measures == m])), [])
        if len(found) == 1:
            return found[0], ""
        return "", (f"sensor is missing; name the one that the law reads, {_listed(found)}" if found else _unread(law))
    _known(where, "sensor", law.sensor, machine.sensors)
    return (law.sensor, "") if law.sensor in can else ("", f"sensor is '{law.sensor}', and {_unread(law)}")


def _unread(law: Wired) -> str:
    what = "position" if isinstance(law, CascadeLaw) else "position or speed"
    return f"a loop is closed here by a sensor that shows the {what} of a body with its direction"


def _drive(where: Path, machine: Description, law: Wired) -> tuple[str, str]:
    """Drive that a law commands and "", or "" and the reason why there is none."""
    if law.drive is not None:
        _known(where, "drive", law.drive, machine.drives)
        return law.drive, ""
    names = list(machine.drives)
    if len(names) == 1:
        return names[0], ""
    if not names:
        return "", "the machine has no drive"
    return "", f"drive is missing; name the one that the law commands, {_listed(names)}"


def _known(where: Path, key: str, name: str, names: Mapping[str, Any]) -> None:
    if name not in names:
        there = f"it should be {_listed(names)}" if names else f"the machine has no {key}"
        hint = perhaps(nearest(name, names))
        raise UserError(f"{where}: controller.{key}: there is no {key} '{name}'; {there}{hint}")


def _listed(names: Any) -> str:
    """Text of a choice: "a, b or c"."""
    *most, last = names
    return f"{', '.join(most)} or {last}" if most else last
