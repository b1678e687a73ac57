"""Lines of text on a described machine: bodies, joints, drives and sensors, in readable units."""

import math
from collections.abc import Iterator

from rtctl.plants.graph.description import Body, Description
from rtctl.plants.graph.mechanics import bodies_of, code_of
from rtctl.plants.graph.term_units import ends_turn, turns_at
from rtctl.plants.graph.units import FORCE, WAY, joint_units, measured_unit

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"))
Line = tuple[str, str]


def si(value: float | None, unit: str) -> str:
    """Text of a number with unit and SI prefix, up to four digits: 21 mN, 1.2 kN/m; None is 0."""
    value = value or 0.0
    plain = unit in ("", "percent") or unit.startswith("kg") or "/" in unit.replace("/m", "").replace("/rad", "")
    if value == 0 or not math.isfinite(value) or plain:
        return f"{value:.4g} {unit}".strip()
    factor, prefix = next(((f, p) for f, p in PREFIXES if abs(value) >= 0.9995 * f), PREFIXES[-1])
    return f"{value / factor:.4g} {prefix}{unit}"


def sentences(machine: Description) -> list[Line]:
    """Pairs of group name and line, one for each element; the name is empty after the first line of a group."""
    groups = (
        ("bodies", _bodies),
        ("mechanics", _mechanics),
        ("joints", _joints),
        ("drives", _drives),
        ("sensors", _sensors),
    )
    found: list[Line] = []
    for group, told in groups:
        found += [(group if n == 0 else "", line) for n, line in enumerate(told(machine))]
    return found


def _bodies(machine: Description) -> Iterator[str]:
    for name, body in machine.bodies.items():
        if machine.is_frame(name):
            yield f"{name} is the frame"
            continue
        size = f"turns, {si(body.inertia, 'kg m^2')}" if body.turns else f"slides, {si(body.mass, 'kg')}"
        yield ", ".join([f"{name} {size}", *_drag(body), *_weight(body)])


def _mechanics(machine: Description) -> Iterator[str]:
    code = code_of(machine)
    if code is None or machine.mechanics is None:
        return
    yield f"{machine.mechanics.kind} moves {' and '.join(bodies_of(machine))} by each other"
    numbers = machine.mechanics.parameters.items()
    yield ", ".join(f"{name} {si(value, code.unit(name).replace('*', ' '))}" for name, value in numbers)


def _drag(body: Body) -> Iterator[str]:
    force, way = FORCE[body.turns], WAY[body.turns]
    if body.dry:
        yield f"dry friction {si(body.dry, force)}"
    if body.viscous:
        yield f"viscous friction {si(body.viscous, f'{force} s/{way}')}"
    if body.pull is not None:
        yield f"pulled by {si(body.pull, force)}"


def _weight(body: Body) -> Iterator[str]:
    for weight in body.weights:
        if weight.incline is not None:
            angle = math.degrees(weight.incline)
            yield "its weight pulls it down" if abs(angle - 90) < 1e-6 else f"on a slope of {angle:.4g} deg"
        else:
            off = math.degrees(weight.angle)
            hangs = f" at {-off:.4g} deg" if off else ""
            yield f"a pendulum of {si(weight.mass, 'kg')} at {si(weight.arm, 'm')} that hangs{hangs}"


def _joints(machine: Description) -> Iterator[str]:
    for name, joint in machine.joints.items():
        a, b = getattr(joint, "from"), joint.to
        units = joint_units(*ends_turn(machine, name))
        ratio = si(joint.ratio, units["ratio"])
        if joint.stiffness is None:
            yield f"{name} couples {a} and {b} rigidly, ratio {ratio}"
            continue
        damping = f", damping {si(joint.damping, units['damping'].replace('*', ' '))}" if joint.damping else ""
        moves = "" if "frame" in (a, b) else f", ratio {ratio}"
        yield f"{name} is a spring from {a} to {b}{moves}, {si(joint.stiffness, units['stiffness'])}{damping}"


def joint_label(machine: Description, name: str) -> list[str]:
    """Ratio and stiffness of a joint, for a drawing."""
    joint, units = machine.joints[name], joint_units(*ends_turn(machine, name))
    ratio = [si(joint.ratio, units["ratio"])] if joint.ratio != 1.0 else []
    return ratio + ([si(joint.stiffness, units["stiffness"])] if joint.stiffness is not None else ["rigid"])


def size_label(machine: Description, name: str) -> str:
    """Inertia or mass of a body, for a drawing."""
    body = machine.bodies.get(name)
    if body is None or machine.is_frame(name):
        return ""
    return si(body.inertia, "kg m^2") if body.turns else si(body.mass, "kg")


def _drives(machine: Description) -> Iterator[str]:
    for name, drive in machine.drives.items():
        turns = turns_at(machine, drive)
        force, made = FORCE[turns], {"force": FORCE[turns], "current": "A", "voltage": "V"}[drive.kind]
        per = f" for 1 {drive.unit}" if drive.unit else ""
        where = drive.body or f"the two ends of {drive.joint}"
        parts = [f"{name} drives {where} by {drive.column}: {si(drive.gain, made)}{per}"]
        if drive.torque_constant is not None:
            parts.append(f"{si(drive.torque_constant, f'{force}/A')}")
        if drive.kind == "voltage":
            parts.append(f"{si(drive.resistance, 'ohm')}, with back-EMF")
        if drive.limit is not None:
            parts.append(f"at most {drive.limit:.4g} {drive.unit}")
        if drive.bandwidth_hz is not None:
            parts.append(f"follows up to {drive.bandwidth_hz:.4g} Hz")
        yield ", ".join(parts)


def _sensors(machine: Description) -> Iterator[str]:
    for name, sensor in machine.sensors.items():
        where = sensor.body or sensor.joint or sensor.drive
        grain = sensor.grain / abs(sensor.scale)
        unit = measured_unit(sensor.measures, turns_at(machine, sensor))
        fine = f", one step is {si(grain, unit)}" if grain else ", of unknown resolution"
        noise = f", noise {si(sensor.noise / abs(sensor.scale), unit)}" if sensor.noise else ""
        yield f"{name} shows the {sensor.measures} of {where} in {sensor.column}{fine}{noise}"
