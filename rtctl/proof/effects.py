"""Effects of the table, first half: friction, drives, clock, loads and sensors, as changes of the true machine.

An effect is a function of (setup, node, size, rng) that changes the setup and returns the sizes for the answers. `size`
1 is a typical amplitude; the draw around it is log-uniform. `rich` forms have more detail than a tool's library: LuGre
for presliding, three harmonics, two relaxations, smooth backlash, heat with a time constant.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.proof import machine
from rtctl.proof.setup import Setup

Sizes = dict[str, float]
Maker = Callable[[Setup, str, float, np.random.Generator], Sizes]


@dataclass(frozen=True)
class Entry:
    make: Maker
    nodes: Mapping[str, tuple[str, ...]]  # plant -> possible nodes
    axes: tuple[str, ...]
    alike: dict[str, tuple[str, ...]]  # "plant:node" or plant -> nodes that count as right
    rich: bool = False


TABLE: dict[str, Entry] = {}
MOTORS = ("motor1", "motor2")
DRIVES = {"ivu": ("drive1", "drive2"), "ldu": ("drive",), "axis": ("drive",)}
LOOP = {"ivu": ("loop",), "ldu": ("loop",), "axis": ("loop",)}
DRY = {"ivu": MOTORS, "ldu": ("carriage",), "axis": ("carriage",)}


def effect(
    name: str, nodes: Mapping[str, tuple[str, ...]], axes: tuple[str, ...], alike: Any = None, rich: bool = False
) -> Callable[[Maker], Maker]:
    """Register a maker under a name of the table."""

    def register(make: Maker) -> Maker:
        TABLE[name] = Entry(make, nodes, axes, alike or {}, rich)
        return make

    return register


def about(rng: np.random.Generator, value: float, spread: float = 0.35) -> float:
    """Log-uniform random number within a factor e^+-spread of `value`."""
    return value * math.exp(rng.uniform(-spread, spread))


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def index(s: Setup, node: str) -> int:
    return s.nodes[node]


def drive_of(s: Setup, node: str) -> int:
    return 1 if node.endswith("2") else 0


def to_force(s: Setup) -> float:
    """Factor from N and m at the carriage to Nm and rad of the node: R_c for the linear drive, else 1."""
    return s.truth["R_c"] if s.plant == "ldu" else 1.0


def level(s: Setup, node: str) -> float:
    """Dry friction at a node (Nm or N), the scale of effect sizes."""
    own = float(s.m["q_F_C"][index(s, node)])
    return own if own > 0.0 and s.plant != "axis" else max(own, 0.35 * s.span["torque"])


@effect("friction.coulomb", DRY | {"ivu": (*MOTORS, "capstan")}, ("velocity",))
def coulomb(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    i, f = index(s, node), to_force(s)
    base = level(s, node) if node != "capstan" or s.plant != "ivu" else 1.2e-3
    added = about(rng, 0.9 * base) * size
    before = float(s.m["q_F_C"][i])
    soft = max(before, 1e-12) / float(s.m["q_sigma0"][i])
    machine.dry(
        s.m, i, before + added, soft, float(s.m["q_friction_law"][i]), float(s.m["q_v_eps"][i]) * (1 + added / before)
    )
    return {"F_C": (before + added) / f, "F_added": added / f}


@effect(
    "friction.viscous", DRY | {"ivu": (*MOTORS, "capstan")}, ("velocity",), {"ldu": ("carriage", "capstan", "wheel")}
)
def viscous(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    typical = {"ivu": 5e-4, "ldu": level(s, node) / s.span["v"], "axis": 0.8 * level(s, node) / s.span["v"]}[s.plant]
    if s.plant == "axis":
        typical = max(typical, 0.6 * s.truth["F_v"])
    B = about(rng, typical) * size
    s.m["q_B"][index(s, node)] += B
    return {"B": B / to_force(s) ** 2}


@effect("friction.stribeck", DRY, ("velocity",))
def stribeck(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    i, f = index(s, node), to_force(s)
    top = about(rng, 0.9 * level(s, node)) * size
    v_s = about(rng, {"ivu": 0.7, "ldu": 0.06 * s.span["v"], "axis": 0.06 * s.span["v"]}[s.plant], 0.6)
    machine.node(s.m, i, F_s=top, v_s=v_s, delta=float(rng.choice([1.0, 2.0])))
    s.m["q_v_eps"][i] *= 2.0
    F_C = float(s.m["q_F_C"][i])
    return {"F_C": F_C / f, "F_s": (F_C + top) / f, "v_s": v_s * (f if s.plant == "ldu" else 1.0)}


@effect("friction.presliding", DRY, ("position", "velocity", "angle"), rich=True)
def presliding(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Presliding friction: Dahl, or LuGre with a small Stribeck rise."""
    i, f = index(s, node), to_force(s)
    travel = about(rng, {"ivu": 0.03, "ldu": 0.02 * s.span["q"] + 2e-5 / f, "axis": 3e-5}[s.plant]) * size
    F = max(float(s.m["q_F_C"][i]), 0.5 * level(s, node))
    sigma0 = F / travel
    machine.node(s.m, i, F_C=F, friction_law=machine.DAHL, sigma0=sigma0, sigma1=0.0)
    if rng.random() < 0.5:
        zeta = rng.uniform(0.1, 0.4)
        machine.node(s.m, i, sigma1=2 * zeta * math.sqrt(sigma0 * float(s.m["q_J"][i])))
        machine.node(s.m, i, F_s=0.1 * F, v_s=0.05 * s.span["v"], delta=2.0)
        s.hidden.torque_sd = s.hidden.torque_sd.copy()
    return {"sigma_0": sigma0 / f**2, "travel": travel * f}


@effect("friction.asymmetry", DRY, ("velocity",))
def asymmetry(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    a = sign(rng) * min(about(rng, 0.3) * size, 0.8)
    s.m["q_asym"][index(s, node)] = a
    return {"asymmetry": a}


@effect("friction.load", {"ivu": ("motor1", "motor2", "capstan")}, ("tension", "velocity"),
        {"ivu:motor1": ("motor1", "reel1"), "ivu:motor2": ("motor2", "reel2")})  # fmt: skip
def load(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Friction mu r |T|: the bearing of a motor carries its tape, the bearing of the capstan both tapes."""
    i = index(s, node)
    arm = about(rng, 6e-3 if node != "capstan" else 2e-3) * size
    s.m["q_mu_load"][i] = arm
    springs = {"motor1": [1], "motor2": [2], "capstan": [1, 2]}[node]
    s.m["load_on"][i, springs] = 1.0
    return {"mu_m": arm}


@effect("drive.offset", DRIVES, ("command", "time"))
def offset(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    volt = sign(rng) * about(rng, 0.12 if s.plant == "ivu" else 0.15 * s.span["u"]) * size
    s.m["d_offset"][drive_of(s, node)] = volt
    return {"offset_V": volt}


@effect("drive.deadband", DRIVES, ("command",), rich=True)
def deadband(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    d = drive_of(s, node)
    band = about(rng, 0.25 if s.plant == "ivu" else 0.3 * s.span["u"]) * size
    machine.drive(s.m, d, band=band, band_soft=float(rng.choice([0.0, 0.1 * band])))
    return {"band_V": band}


@effect("drive.gain_asymmetry", DRIVES, ("command",))
def gain_asymmetry(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    a = sign(rng) * about(rng, 0.14) * size
    s.m["d_asym"][drive_of(s, node)] = a
    return {"asymmetry": a}


@effect("drive.saturation", DRIVES, ("command",), rich=True)
def saturation(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    d = drive_of(s, node)
    volt = (
        s.span.get("u_top", 4.0 * s.span["u"])
        * about(rng, 0.8 if s.plant == "axis" else 0.6, 0.15)
        * (1.2 - 0.2 * size)
    )
    amp = float(s.m["d_amp"][d])
    machine.drive(s.m, d, sat_A=volt * amp, sat_soft=float(rng.choice([0.02, 0.15])))
    return {"limit_V": volt, "limit_A": volt * amp}


@effect("drive.lag", DRIVES, ("frequency", "time"))
def lag(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    tau = about(rng, {"ivu": 0.005, "ldu": 0.0045, "axis": 0.003}[s.plant]) * size
    s.m["d_lag"][drive_of(s, node)] = tau
    return {"tau_s": tau}


@effect("drive.supply_sag", {"ivu": ("drive1", "drive2"), "ldu": ("drive",)}, ("command",),
        {"ivu": ("drive1", "drive2", "loop"), "ldu": ("drive", "loop")}, rich=True)  # fmt: skip
def supply_sag(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Common supply of both drives: gain falls with the total current, after a capacitor's time constant."""
    per_A = about(rng, 0.25) * size / (float(s.m["d_amp"][0]) * s.span["u_top"])
    s.m["d_sag"][:] = per_A
    s.m["d_sag_tau"][:] = float(rng.choice([0.0, 0.02]))
    return {"per_A": per_A}


@effect("drive.thermal", DRIVES, ("time",), {"ivu:drive1": ("drive1", "motor1"), "ivu:drive2": ("drive2", "motor2"),
        "ldu": ("drive", "motor")}, rich=True)  # fmt: skip
def thermal(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    d = drive_of(s, node)
    fall = about(rng, 0.2) * size
    tau = about(rng, 0.5 * s.n * s.Ts)
    rms = float(s.m["d_amp"][d]) * s.span.get(f"u_rms{d}", s.span["u"])
    machine.drive(s.m, d, heat_gain=fall, heat_tau=tau, rms_A=rms)
    if rng.random() < 0.3:
        s.m["q_warm_F"][int(s.m["d_node"][d])] = -0.5 * fall
    return {"fall": fall, "tau_s": tau}


@effect("timing.delay", LOOP, ("frequency", "time"))
def delay(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    extra = about(rng, {"ivu": 1.5, "ldu": 14.0, "axis": 1.5}[s.plant]) * size
    s.m["delay"] += extra
    return {"extra_samples": extra}


@effect("timing.jitter", LOOP, ("time",), rich=True)
def jitter(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Deviations of the tick times, symmetric or only late; the recorded clock shows them or not."""
    rms = about(rng, {"ivu": 0.15, "ldu": 0.25, "axis": 0.12}[s.plant]) * s.Ts * size
    s.hidden.jitter_s = rms
    s.hidden.jitter_skew = float(rng.choice([0.0, 1.0]))
    s.hidden.clock_tells = bool(rng.random() < 0.5)
    return {"rms_s": rms}


@effect("load.spring", {"ldu": ("carriage",), "axis": ("carriage",)}, ("position",))
def load_spring(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    travel = max(s.span.get("q_top", s.span["q"]), 1e-9)
    k = about(rng, 0.5 * level(s, node) / travel) * size
    s.m["q_k_pos"][index(s, node)] += k
    return {"k_N_per_m": k / to_force(s) ** 2}


@effect("load.imbalance", {"ivu": ("reel1", "reel2", "motor1", "motor2"), "ldu": ("wheel",)}, ("angle", "position"),
        {"ivu:reel1": ("reel1", "motor1"), "ivu:motor1": ("motor1", "reel1"), "ivu:reel2": ("reel2", "motor2"),
         "ivu:motor2": ("motor2", "reel2"), "ldu": ("wheel", "capstan", "encoder", "carriage")})  # fmt: skip
def imbalance(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    i = index(s, node)
    torque = about(rng, {"ivu": 2.5e-3, "ldu": 0.25 * s.span["torque"]}[s.plant]) * size
    s.m["wave_a"][i, 3], s.m["wave_n"][i, 3], s.m["wave_ph"][i, 3] = torque, 1.0, rng.uniform(0, 2 * math.pi)
    return {"torque_Nm": torque}


@effect("load.bump", {"ldu": ("carriage",), "axis": ("carriage",)}, ("position", "angle"), rich=True)
def bump(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Local friction (dirt), or a bump that pushes back and then forward (a rail joint)."""
    i, f = index(s, node), to_force(s)
    at = rng.choice(s.ref[np.abs(np.gradient(s.ref)) > 0.2 * s.span["v"] * f * s.Ts]) if s.n else 0.0
    force = about(rng, 1.0 * level(s, node)) * size
    width = about(rng, 0.05 * s.span["q"])
    machine.node(s.m, i, bump_F=force, bump_at=at / f, bump_w=width, bump_drag=float(rng.choice([0.0, 1.0])))
    return {"at_m": float(at), "force_N": force / f, "width_m": width * f}


@effect("sensor.missed_counts", {"ivu": ("encoder",), "ldu": ("encoder", "scale"), "axis": ("sensor",)}, ("time",),
        {"ivu": ("encoder", "capstan")})  # fmt: skip
def missed_counts(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    y = 1 if node == "scale" else 0
    rate = about(rng, 0.4)
    counts = max(round(about(rng, {"ivu": 25.0, "ldu": 40.0, "axis": 80.0}[s.plant]) * size), 3)
    s.hidden.lost_rate[y], s.hidden.lost_counts[y] = rate, counts
    return {"counts": float(counts), "per_s": rate}


@effect("sensor.scale", {"ldu": ("scale",), "ivu": ("capstan",)}, ("position",),
        {"ldu": ("encoder", "scale", "capstan"), "ivu": ("capstan", "encoder", "reel1", "reel2")})  # fmt: skip
def scale(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Scale factor of a reading; on the reel unit, of the capstan (and its counts) against the reels."""
    relative = sign(rng) * about(rng, 6e-4 if s.plant == "ldu" else 0.06) * size
    s.m["y_relative"][1 if s.plant == "ldu" else 0] = 1.0 + relative
    return {"relative": relative}


@effect("sensor.rectified", {"ldu": ("scale",)}, ("velocity", "position"))
def rectified(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    s.m["y_kind"][1] = machine.EDGES
    return {}
