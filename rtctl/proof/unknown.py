"""Unknown physics: effects without a name in the table. Any name in an answer is wrong."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from rtctl.proof import machine
from rtctl.proof.effects import about, index, level, sign
from rtctl.proof.setup import Setup

Maker = Callable[[Setup, str, float, np.random.Generator], None]
MAIN = {"ivu": ("motor1", "motor2"), "ldu": ("carriage",), "axis": ("carriage",)}
SENSE = {"ivu": ("encoder",), "ldu": ("encoder",), "axis": ("sensor",)}
UNKNOWN: dict[str, tuple[Maker, Mapping[str, tuple[str, ...]]]] = {}


def unknown(name: str, nodes: Mapping[str, tuple[str, ...]]) -> Callable[[Maker], Maker]:
    def register(make: Maker) -> Maker:
        UNKNOWN["unknown." + name] = (make, nodes)
        return make

    return register


@unknown("loose_mass", MAIN)
def loose_mass(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Loose mass between two stops."""
    i = index(s, node)
    J = about(rng, 0.4) * size * float(s.m["q_J"][i])
    w = 2 * math.pi * about(rng, {"ivu": 25.0, "ldu": 55.0, "axis": 30.0}[s.plant])
    extra = machine.add_node(s.m, J)
    j = machine.spring(s.m, i, extra, 1.0, -1.0, J * w * w, 0.2 * w * J)
    s.m["s_gap"][j] = about(rng, {"ivu": 0.15, "ldu": 0.004 * s.span["q"], "axis": 5e-4}[s.plant])


@unknown("random_torque", MAIN)
def random_torque(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    s.hidden.random_sd[index(s, node)] = about(rng, 0.35 * level(s, node)) * size
    s.hidden.random_tau = about(rng, 0.1, 1.0)


@unknown("crosstalk", SENSE)
def crosstalk(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Crosstalk of the drive's voltage into the reading."""
    s.m["y_cross"][0] = sign(rng) * about(rng, {"ivu": 20.0, "ldu": 5.0, "axis": 10.0}[s.plant]) * size


@unknown("air_drag", MAIN)
def air_drag(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    s.m["q_F_q"][index(s, node)] = about(rng, 1.5 * level(s, node) / (0.6 * s.span["v"]) ** 2) * size


@unknown("detent", MAIN)
def detent(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Magnetic detents with hysteresis: they follow the rotor for part of a pitch."""
    n = about(rng, 9.0) if s.plant == "ivu" else 2 * math.pi / about(rng, 0.15 * s.span["q"])
    machine.node(s.m, index(s, node), det_a=about(rng, 0.8 * level(s, node)) * size, det_n=n, det_play=0.7 / n)


@unknown("friction_spots", MAIN)
def spots(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Intermittent friction at random times."""
    i = index(s, node)
    s.m["q_spot_F"][i] = about(rng, 1.2 * level(s, node)) * size
    s.hidden.spot_rate, s.hidden.spot_s = about(rng, 12.0 / (s.n * s.Ts)), about(rng, 0.25)


@unknown("parametric_stiffness", {"ivu": ("motor1", "motor2"), "ldu": ("capstan",)})
def parametric(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Shaft stiffness that depends on its angle."""
    j = {"motor1": 0, "motor2": 3, "capstan": 1}[node]
    s.m["s_par_a"][j], s.m["s_par_n"][j] = 0.85 * min(size, 1.0), 3.0
    s.m["s_c"][j] *= {"ivu": 0.08, "ldu": 0.6}[s.plant] / size


@unknown("negative_damping", MAIN)
def negative_damping(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Negative damping in a band of speeds."""
    v = about(rng, 0.3 * s.span["v"])
    machine.node(s.m, index(s, node), F_neg=about(rng, 0.7 * level(s, node)) * size, v_neg=v, w_neg=0.25 * v)


@unknown("supply_pulse", {"ivu": ("drive1", "drive2"), "ldu": ("drive",), "axis": ("drive",)})
def supply_pulse(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Gain modulated at mains frequency."""
    d = 1 if node.endswith("2") else 0
    hz = {"ivu": about(rng, 4.0, 0.8), "ldu": about(rng, 15.0, 0.8), "axis": about(rng, 6.0, 0.8)}[s.plant]
    machine.drive(s.m, d, pulse_a=about(rng, 0.5) * size, pulse_f=hz)


@unknown("gyroscopic", {"ivu": ("reel2", "capstan")})
def gyroscopic(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Torque proportional to the product of two speeds."""
    s.m["q_gyro"][index(s, node)] = sign(rng) * about(rng, 2.5e-3 / (0.4 * s.span["v"]) ** 2) * size


@unknown("sensor_walk", SENSE)
def sensor_walk(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    s.hidden.walk[0] = about(rng, {"ivu": 12.0, "ldu": 20.0, "axis": 40.0}[s.plant]) * size


@unknown("ringing", MAIN)
def ringing(s: Setup, node: str, size: float, rng: np.random.Generator) -> None:
    """Decaying oscillation after each reversal."""
    w = 2 * math.pi * about(rng, {"ivu": 7.0, "ldu": 35.0, "axis": 12.0}[s.plant])
    v = 0.02 * s.span["v"]
    machine.node(s.m, index(s, node), ring_a=about(rng, 2.0 * level(s, node)) * size, ring_w=w, ring_z=0.02, ring_v=v)
