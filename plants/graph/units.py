"""Units of a description's numbers, by the kind of element that they belong to."""

from collections.abc import Mapping
from typing import Any

from rtctl.config.errors import nearest
from rtctl.config.units import to_si

TURNS, SLIDES = "rad", "m"
BODY = {  # key -> unit where the body turns, and where it slides
    "inertia": ("kg*m^2", "kg*m^2"), "mass": ("kg", "kg"), "dry": ("Nm", "N"), "viscous": ("Nm*s/rad", "N*s/m"),
    "radius": ("m", "m"), "pull": ("Nm", "N"),
}  # fmt: skip
REEL = {"core": "m", "thickness": "m", "density": "kg/m^3", "width": "m"}
GRAVITY = {"mass": "kg", "arm": "m", "angle": "rad", "incline": "rad"}
FITS = {  # place -> what a sensor can measure there
    "body": ("position", "speed", "acceleration"), "joint": ("position", "speed", "force"), "drive": ("current",),
}  # fmt: skip
FORCE = {True: "Nm", False: "N"}
WAY = {True: TURNS, False: SLIDES}


def joint_units(from_turns: bool, to_turns: bool) -> dict[str, str]:
    """Units of a joint's numbers: ratio, stiffness and damping in units of `to`."""
    a, b, force = WAY[from_turns], WAY[to_turns], FORCE[to_turns]
    return {
        "ratio": "" if a == b else f"{b}/{a}",
        "stiffness": f"{force}/{b}",
        "damping": f"{force}*s/{b}",
    }


def drive_units(kind: str, command: str, turns: bool) -> dict[str, str]:
    """Units of a drive's numbers, for a command in the unit `command`."""
    made = {"force": FORCE[turns], "current": "A", "voltage": "V"}.get(kind, "")
    command = {"%": "percent"}.get(command, command)
    gain = "" if made == command else f"{made}/{command}" if command else made
    return {
        "gain": gain, "torque_constant": f"{FORCE[turns]}/A", "resistance": "ohm", "inductance": "H",
        "limit": command, "output_limit": command, "dac_range": command, "bandwidth_hz": "Hz", "damping": "",
        "zero": "s",
    }  # fmt: skip


def measured_unit(measures: str, turns: bool) -> str:
    """SI unit of what a sensor measures."""
    way = WAY[turns]
    return {
        "position": way, "speed": f"{way}/s", "acceleration": f"{way}/s^2", "force": FORCE[turns], "current": "A",
    }[measures]  # fmt: skip


def in_si(data: Mapping[str, Any]) -> dict[str, Any]:
    """The data of a description with every quantity that has a unit as a number in SI.

    Raises ValueError, with the dotted path in front, where a unit does not fit the element.
    """
    out = dict(data)
    bodies = data.get("bodies")
    _check_bodies(data)
    turns = {
        name: not (isinstance(body, Mapping) and body.get("mass") is not None) for name, body in _items(bodies)
    }  # of every body, as it is written

    def kind_of(name: Any) -> bool:
        return turns.get(str(name), True)

    out["bodies"] = _each(data, "bodies", lambda path, body: _body(path, body))
    out["joints"] = _each(
        data,
        "joints",
        lambda path, joint: _converted(path, joint, joint_units(*_ends(joint, turns))),
    )
    joints = dict(_items(data.get("joints")))

    def acts_on_turning(element: Mapping[str, Any]) -> bool:
        if element.get("body") is not None:
            return kind_of(element["body"])
        joint = joints.get(str(element.get("joint")), {})
        return _ends(joint, turns)[1] if isinstance(joint, Mapping) else True

    out["drives"] = _each(
        data,
        "drives",
        lambda path, drive: _converted(
            path,
            drive,
            drive_units(str(drive.get("kind", "force")), str(drive.get("unit", "V")), acts_on_turning(drive)),
        ),
    )
    out["sensors"] = _each(
        data,
        "sensors",
        lambda path, sensor: _converted(path, sensor, _sensor_units(path, sensor, acts_on_turning(sensor))),
    )
    return {key: value for key, value in out.items() if key in data}


def _check_bodies(data: Mapping[str, Any]) -> None:
    """Raise ValueError where an element is at a body that is not described, so that its units are unknown."""
    known = [*(str(name) for name, _ in _items(data.get("bodies"))), "frame"]
    for group, keys in (("joints", ("from", "to")), ("drives", ("body",)), ("sensors", ("body",))):
        for name, element in _items(data.get(group)):
            for key in keys if isinstance(element, Mapping) else ():
                body = element.get(key)
                if isinstance(body, str) and body not in known:
                    near = nearest(body, known)
                    hint = f"did you mean '{near}'?" if near else f"there is {', '.join(known)}"
                    raise ValueError(f"{group}.{name}.{key}: there is no body '{body}'; {hint}")


def _ends(joint: Mapping[str, Any], turns: Mapping[str, bool]) -> tuple[bool, bool]:
    """Whether the two ends of a joint turn; the frame is as the other end. A span is a length of tape: it slides."""
    if joint.get("span") is not None:
        return False, False
    a, b = turns.get(str(joint.get("from"))), turns.get(str(joint.get("to")))
    a = a if a is not None else b if b is not None else True
    return a, b if b is not None else a


def _sensor_units(path: str, sensor: Mapping[str, Any], turns: bool) -> dict[str, str]:
    measures = str(sensor.get("measures", "position"))
    check_place(f"{path}.", next((key for key in FITS if sensor.get(key) is not None), ""), measures)
    if measures not in ("position", "speed", "acceleration", "force", "current"):
        return {}
    unit = measured_unit(measures, turns)
    si = "counts_per_unit" not in sensor and sensor.get("per_unit", 1) in (1, -1)  # a minus reverses the direction
    column = {"resolution": unit, "noise": unit} if si else {}
    return {"counts_per_unit": _per(unit), **column}


def check_place(path: str, where: str, measures: str) -> None:
    """Raise ValueError where nothing of the kind can be measured at a body, joint or drive."""
    if where and measures not in FITS[where]:
        fits = ", ".join(FITS[where])
        raise ValueError(f"{path}measures: {measures} is not seen at a {where}; it can be {fits}")


def _per(unit: str) -> str:
    """Unit of counts for one of `unit`: 1/rad, s/rad, 1/N."""
    over, _, under = unit.partition("/")
    return f"{under}/{over}" if under else f"1/{over}"


def _body(path: str, body: Mapping[str, Any]) -> dict[str, Any]:
    slides = body.get("mass") is not None
    if not slides and "inertia" not in body and not body.get("fixed"):
        raise ValueError(f"{path}: give inertia (a body that turns) or mass (a body that slides)")
    out = _converted(path, body, {key: pair[slides] for key, pair in BODY.items()})
    if isinstance(out.get("reel"), Mapping):
        out["reel"] = _converted(f"{path}.reel", out["reel"], REEL)
    weight = out.get("gravity")
    if isinstance(weight, Mapping):
        out["gravity"] = _converted(f"{path}.gravity", weight, GRAVITY)
    elif isinstance(weight, list):
        out["gravity"] = [
            _converted(f"{path}.gravity.{i}", item, GRAVITY) if isinstance(item, Mapping) else item
            for i, item in enumerate(weight)
        ]
    return out


def _each(data: Mapping[str, Any], group: str, convert: Any) -> Any:
    given = data.get(group)
    if not isinstance(given, Mapping):
        return given
    return {
        name: convert(f"{group}.{name}", element) if isinstance(element, Mapping) else element
        for name, element in given.items()
    }


def _items(group: Any) -> Any:
    return group.items() if isinstance(group, Mapping) else ()


def _converted(path: str, element: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
    out = dict(element)
    for key, unit in units.items():
        if isinstance(out.get(key), str):
            try:
                out[key] = to_si(out[key], unit)
            except ValueError as error:
                raise ValueError(f"{path}.{key}: {error}") from None
    return out
