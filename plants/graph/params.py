"""Params of a described machine: the numbers of its elements in arrays, for the one kernel that runs all machines."""

from typing import Any, NamedTuple

import numpy as np

from rtctl.plants import linear
from rtctl.plants.graph.layout import NOWHERE, Layout

FORCE, CURRENT, VOLTAGE = range(3)
KINDS = {"force": FORCE, "current": CURRENT, "voltage": VOLTAGE}
POSITION, SPEED, ACCELERATION, TENSION, AMPERES = range(5)
MEASURES = {
    "position": POSITION, "speed": SPEED, "acceleration": ACCELERATION, "force": TENSION, "current": AMPERES,
}  # fmt: skip
MOST_WEIGHTS = 12
Q, L, U, Y = linear.MOST_BODIES, linear.MOST_LINKS, linear.MOST_DRIVES, linear.MOST_SENSORS


class GraphParams(NamedTuple):
    """Parameters of a machine. A place is a pair of coordinates i, j with factors a, b of its motion a q_i + b q_j."""

    h: float  # s, one substep
    nq: int
    nx: int
    nu: int
    ny: int
    nl: int
    inertia: np.ndarray  # (Q,) of each coordinate
    dry: np.ndarray  # (Q,)
    viscous: np.ndarray  # (Q,)
    link_i: np.ndarray  # (L,)
    link_j: np.ndarray
    link_a: np.ndarray
    link_b: np.ndarray
    link_c: np.ndarray  # stiffness
    link_k: np.ndarray  # damping
    link_wound: np.ndarray  # 1: a span that a reel winds
    link_reel_i: np.ndarray  # reel whose coordinate is at the end i, j; NOWHERE where there is none
    link_reel_j: np.ndarray
    weights: int
    weight_i: np.ndarray  # (MOST_WEIGHTS,)
    weight_a: np.ndarray
    weight_force: np.ndarray  # N or Nm
    weight_angle: np.ndarray  # rad
    weight_turns: np.ndarray  # 1: goes with the sine of the body's angle
    drive_i: np.ndarray  # (U,)
    drive_j: np.ndarray
    drive_a: np.ndarray
    drive_b: np.ndarray
    drive_kind: np.ndarray
    drive_at: np.ndarray  # first of its states in x
    drive_gain: np.ndarray
    drive_limit: np.ndarray  # of the command
    drive_top: np.ndarray  # of the output, in units of the command
    drive_K: np.ndarray  # torque constant
    drive_R: np.ndarray
    drive_L: np.ndarray
    drive_w: np.ndarray  # rad/s, natural frequency; 0 where the drive follows at once
    drive_zeta: np.ndarray
    drive_zero: np.ndarray  # s, time constant of a zero of the low pass
    sensor_kind: np.ndarray  # (Y,)
    sensor_i: np.ndarray
    sensor_j: np.ndarray
    sensor_a: np.ndarray
    sensor_b: np.ndarray
    sensor_of: np.ndarray  # link or drive
    reels: int
    winds: int  # 1: the radii follow the tape
    reel_i: np.ndarray  # (MOST_REELS,) coordinate
    reel_R: np.ndarray  # m, radius at the start
    reel_core: np.ndarray  # m, radius of the empty reel
    reel_grow: np.ndarray  # m/rad, growth of the radius
    reel_moved: np.ndarray  # 1: a drive or viscous friction acts on it
    reel_paper: np.ndarray  # kg/m^2, inertia for a radius to the fourth power


def build(layout: Layout, values: dict[str, float], h: float) -> GraphParams:
    """Params for substeps of `h` s; `values` are the numbers of the description by dotted path, SI."""
    machine = layout.machine
    a = {name: np.zeros(size) for name, size in SIZES.items()}
    for name, body in machine.bodies.items():
        if layout.bodies[name].coordinate == NOWHERE:
            continue
        at, r = layout.coordinate(name), layout.ratio(name, values)
        path = f"bodies.{name}"
        a["inertia"][at] += r * r * values[f"{path}.{'inertia' if body.turns else 'mass'}"]
        a["dry"][at] += abs(r) * values.get(f"{path}.dry", 0.0)
        a["viscous"][at] += r * r * values.get(f"{path}.viscous", 0.0)
    for name, number in layout.links.items():
        _put_place(a, "link", number, joint_place(layout, name, values))
        a["link_c"][number] = values[f"joints.{name}.stiffness"]
        a["link_k"][number] = values.get(f"joints.{name}.damping", 0.0)
    weights = _weights(layout, values, a)
    nx = 2 * layout.nq
    for name, number in layout.drives.items():
        drive, path = machine.drives[name], f"drives.{name}"
        _put_place(a, "drive", number, place(layout, drive, values))
        a["drive_kind"][number], a["drive_at"][number] = KINDS[drive.kind], nx
        a["drive_gain"][number] = values[f"{path}.gain"]
        a["drive_limit"][number] = values.get(f"{path}.limit", np.inf)
        a["drive_top"][number] = values.get(f"{path}.output_limit", np.inf)
        a["drive_K"][number] = values.get(f"{path}.torque_constant", 1.0)
        a["drive_R"][number] = values.get(f"{path}.resistance", 1.0)
        a["drive_L"][number] = values.get(f"{path}.inductance", 0.0)
        a["drive_w"][number] = 2.0 * np.pi * values.get(f"{path}.bandwidth_hz", 0.0)
        a["drive_zeta"][number] = values.get(f"{path}.damping", 0.7071)
        a["drive_zero"][number] = values.get(f"{path}.zero", 0.0)
        nx += states_of(drive)
    for name, number in layout.sensors.items():
        sensor = machine.sensors[name]
        a["sensor_kind"][number] = MEASURES[sensor.measures]
        if sensor.drive is not None:
            a["sensor_of"][number] = layout.drives[sensor.drive]
            continue
        if sensor.joint is not None:
            a["sensor_of"][number] = layout.links[sensor.joint]
        _put_place(a, "sensor", number, place(layout, sensor, values))
    reels = _reels(layout, values, a)
    whole = {key: a[key].astype(np.int64) for key in WHOLE}
    return GraphParams(
        h=h, nq=layout.nq, nx=nx, nu=len(layout.drives), ny=len(layout.sensors), nl=len(layout.links),
        weights=weights, reels=reels, winds=int(a["reel_grow"].any()), **{**a, **whole},
    )  # fmt: skip


def states_of(drive: Any) -> int:
    """Number of states of a drive: two of its low pass, one of its current."""
    return 2 * (drive.bandwidth_hz is not None) + (drive.kind == "voltage" and drive.inductance is not None)


def drive_gain(values: dict[str, float], name: str) -> float:
    """Force of a drive on a body that is held, for one unit of its command, N or Nm."""
    path = f"drives.{name}"
    gain = values[f"{path}.gain"] * values.get(f"{path}.torque_constant", 1.0)
    return gain / values.get(f"{path}.resistance", 1.0)


def place(layout: Layout, element: Any, values: dict[str, float]) -> tuple[int, float, int, float]:
    """Place of a drive or sensor: coordinates, and the motion there for one unit of each."""
    if element.joint is not None:
        return joint_place(layout, element.joint, values)
    at = layout.coordinate(element.body)
    return at, layout.ratio(element.body, values), at, 0.0


def joint_place(layout: Layout, name: str, values: dict[str, float]) -> tuple[int, float, int, float]:
    """Elongation of a joint by coordinates, that of `to` first: q_to - ratio q_from, or of a span
    R_to q_to -+ R_from q_from."""
    joint = layout.machine.joints[name]
    a, b = getattr(joint, "from"), joint.to
    i, j = layout.coordinate(b), layout.coordinate(a)
    if joint.span is None:
        of_to, of_from = layout.ratio(b, values), -values[f"joints.{name}.ratio"] * layout.ratio(a, values)
    else:
        of_to, of_from = (values[f"bodies.{body}.radius"] * layout.ratio(body, values) for body in (b, a))
        of_from = -of_from if joint.span == "open" else of_from
    if of_to == 0.0:  # the frame
        i = j
    if of_from == 0.0:
        j = i
    return i, of_to, j, of_from


def _put_place(a: dict[str, np.ndarray], what: str, number: int, at: tuple[int, float, int, float]) -> None:
    a[f"{what}_i"][number], a[f"{what}_a"][number], a[f"{what}_j"][number], a[f"{what}_b"][number] = at


def _weights(layout: Layout, values: dict[str, float], a: dict[str, np.ndarray]) -> int:
    n = 0
    for name, body in layout.machine.bodies.items():
        for k, weight in enumerate(body.weights):
            path = f"bodies.{name}.gravity" + (f".{k}" if isinstance(body.gravity, list) else "")
            if n >= MOST_WEIGHTS:
                raise ValueError(f"{path}: {MOST_WEIGHTS} weights are the most that one machine can have")
            a["weight_i"][n], a["weight_a"][n] = layout.coordinate(name), layout.ratio(name, values)
            if weight.incline is None:
                a["weight_force"][n] = values[f"{path}.mass"] * G_N * values[f"{path}.arm"]
                a["weight_angle"][n] = values.get(f"{path}.angle", 0.0)
                a["weight_turns"][n] = 1
            else:
                a["weight_force"][n] = values[f"bodies.{name}.mass"] * G_N * np.sin(values[f"{path}.incline"])
            n += 1
        if body.pull is not None and layout.bodies[name].coordinate != NOWHERE:
            n = _put_pull(layout, values, a, n, name)
    return n


def _put_pull(layout: Layout, values: dict[str, float], a: dict[str, np.ndarray], n: int, name: str) -> int:
    """A constant force is a weight that does not turn with its body."""
    path = f"bodies.{name}.pull"
    if n >= MOST_WEIGHTS:
        raise ValueError(f"{path}: {MOST_WEIGHTS} weights and pulls are the most that one machine can have")
    a["weight_i"][n], a["weight_a"][n] = layout.coordinate(name), layout.ratio(name, values)
    a["weight_force"][n] = -values[path]
    return n + 1


def _reels(layout: Layout, values: dict[str, float], a: dict[str, np.ndarray]) -> int:
    a["link_reel_i"][:], a["link_reel_j"][:] = NOWHERE, NOWHERE
    reels = [name for name, body in layout.machine.bodies.items() if body.reel is not None]
    for number, name in enumerate(reels):
        path, at = f"bodies.{name}", layout.coordinate(name)
        a["reel_i"][number], a["reel_R"][number] = at, values[f"{path}.radius"]
        a["reel_core"][number] = values[f"{path}.reel.core"]
        a["reel_grow"][number] = values[f"{path}.reel.thickness"] / (2.0 * np.pi)
        a["reel_paper"][number] = 0.5 * np.pi * (values[f"{path}.reel.density"] * values[f"{path}.reel.width"])
        driven = any(at in (a["drive_i"][d], a["drive_j"][d]) for d in layout.drives.values())
        a["reel_moved"][number] = driven or a["viscous"][at] != 0.0
        for joint, link in layout.links.items():
            for end in ("i", "j"):
                if a[f"link_{end}"][link] == at:
                    a[f"link_reel_{end}"][link] = number
                    a["link_wound"][link] += layout.machine.joints[joint].span is not None
    return len(reels)


G_N = 9.80665  # m/s^2
WHOLE = (
    "link_i", "link_j", "link_wound", "link_reel_i", "link_reel_j", "weight_i", "weight_turns", "drive_i", "drive_j",
    "drive_kind", "drive_at", "sensor_kind", "sensor_i", "sensor_j", "sensor_of", "reel_i", "reel_moved",
)  # fmt: skip
SIZES = {
    name: Q if name in ("inertia", "dry", "viscous")
    else {"link": L, "weight": MOST_WEIGHTS, "drive": U, "sensor": Y, "reel": linear.MOST_REELS}[name.partition("_")[0]]
    for name in GraphParams._fields
    if name not in ("h", "nq", "nx", "nu", "ny", "nl", "weights", "reels", "winds")
}  # fmt: skip
