"""Effects of joints and attached masses: backlash, hysteresis, slip, creep, transmission error, compliance."""

import math

import numpy as np

from rtctl.proof.machines import arrays
from rtctl.proof.machines.draft import ELASTIC, RIGID
from rtctl.proof.machines.effect import (
    Setup,
    Sizes,
    UnfitError,
    about,
    bodies,
    effect,
    form,
    inertia_at,
    joint_force,
    rotary_bodies,
    sign,
    span,
    springs,
)  # fmt: skip
from rtctl.proof.machines.kinematics import joint_hz, rotary


def bend(s: Setup, node: str) -> float:
    """Standard deviation of the deflection of a spring (m or rad)."""
    return joint_force(s, node) / float(s.m["j_k"][s.joint(node)])


@effect("transmission.backlash", springs, ("velocity", "command", "tension", "position"), ELASTIC)
def backlash(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Backlash with hard or rounded edges, in a joint with a force of both signs."""
    j = s.joint(node)
    T = s.seen["T"][:, j]
    if min(np.mean(T > 0.0), np.mean(T < 0.0)) < 0.05:
        raise UnfitError("the joint's force never changes its sign")
    far = s.machine["joints"][node]["to"]
    gap = about(rng, max(3.0 * bend(s, node), 4e-4 * span(s, far)), 0.5) * size
    s.m["j_gap"][j], s.m["j_soft"][j] = gap, (0.0, 0.15 * gap)[form(rng, 2)]
    return {"gap": gap}


@effect("transmission.hysteresis", springs, ("tension", "position", "velocity"), ELASTIC)
def hysteresis(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Hysteresis of a joint: Dahl, or sliding elements of several lengths (Iwan)."""
    j = s.joint(node)
    H = about(rng, 0.5 * joint_force(s, node)) * size
    z0 = about(rng, 0.6 * bend(s, node))
    s.m["j_H"][j], s.m["j_z0"][j] = H, z0
    s.m["j_Hlaw"][j] = arrays.DAHL if form(rng, 2) else arrays.IWAN
    return {"H": H, "z_0": z0}


@effect("transmission.slip", springs, ("tension", "time", "command"), ELASTIC)
def slip(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Slip above a force limit: dry, or with a speed that grows above the limit."""
    j = s.joint(node)
    T = np.abs(s.seen["T"][:, j])
    if abs(float(np.mean(s.seen["T"][:, j]))) > 1.0 * joint_force(s, node):
        raise UnfitError("a joint under constant load would slide away")
    limit = float(np.quantile(T, 1.0 - about(rng, 0.02, 0.5) * size))
    s.m["j_limit"][j] = limit
    s.m["j_eta"][j] = (0.0, about(rng, 0.01) * float(s.m["j_k"][j]))[form(rng, 2)]
    return {"limit": limit}


@effect("transmission.creep", springs, ("tension", "time", "position"), ELASTIC)
def creep(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Creep proportional to force, per travel or per time."""
    j, joint = s.joint(node), s.machine["joints"][node]
    T, way = joint_force(s, node), span(s, joint["to"])
    v = float(np.mean(np.abs(s.seen["v"][:, s.body(joint["to"])])))
    drift = about(rng, 6e-3 * way) * size
    seconds = math.sqrt(s.n * s.Ts)
    if form(rng, 2):
        s.m["j_creep"][j] = drift / (T * seconds)
    else:
        s.m["j_creepv"][j] = drift / (T * v * seconds)
    return {"rate": float(s.m["j_creep"][j] + s.m["j_creepv"][j])}


def _turning(s: Setup) -> list[str]:
    return [j for j in springs(s) if rotary(s.machine, s.machine["joints"][j]["from"])]


@effect("ripple.ratio", _turning, ("angle", "position"), ELASTIC)
def ratio(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Transmission error over the angle of one end: one harmonic, or several."""
    j, joint = s.joint(node), s.machine["joints"][node]
    end = joint["to"] if rotary(s.machine, joint["to"]) and form(rng, 2) else joint["from"]
    i = s.body(end)
    wide = float(np.ptp(s.seen["q"][:, i]))
    n = 1.0 if wide > 8.0 else float(math.ceil(12.0 / max(wide, 1e-9)))
    if n > 60.0:
        raise UnfitError("the body hardly turns")
    k, fast = float(s.m["j_k"][j]), float(np.quantile(np.abs(s.seen["v"][:, i]), 0.9))
    A = about(rng, max(2.5 * bend(s, node), 1.2e-3 * span(s, joint["to"]))) * size
    A = min(A, 4.0 * joint_force(s, node) / k * max(1.0, (2 * math.pi * joint_hz(s.machine, node) / (n * fast)) ** 2))
    s.m["j_ripend"][j] = float(end == joint["to"])
    for h in range(1 + 2 * form(rng, 2)):
        s.m["j_rip"][j, h], s.m["j_ripn"][j, h] = A * 0.45**h, n * (h + 1)
        s.m["j_ripa"][j, h] = rng.uniform(0.0, 2.0 * math.pi)
    return {"amplitude": A, "per_turn": n}


@effect("structure.stiffening", springs, ("tension", "position"), ELASTIC)
def stiffening(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Stiffness that grows with a power of the deflection, or exponentially."""
    j = s.joint(node)
    power = (2.0, 1.0, 0.0)[form(rng, 3)]
    e0, beta = about(rng, 1.5 * bend(s, node)), about(rng, 1.2) * size
    s.m["j_beta"][j], s.m["j_e0"][j], s.m["j_p"][j] = beta, e0, power
    return {"beta": beta, "e_0": e0, "exponent": power}


def _stiff(s: Setup) -> list[str]:
    return [j for j, joint in s.machine["joints"].items() if "stiffness" not in joint]


@effect("structure.compliance", _stiff, ("frequency", "tension"), RIGID)
def compliance(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Compliance of a nominally rigid joint: linear, or softer at small deflections."""
    j, joint = s.joint(node), s.machine["joints"][node]
    n, near = joint["ratio"], float(s.m["b_J"][s.body(joint["from"])])
    near, far = near / n**2, float(s.m["b_J"][s.body(joint["to"])])
    w = 2.0 * math.pi * min(about(rng, 18.0) / math.sqrt(size), 140.0)
    k = near * far / (near + far) * w * w
    s.m["j_rigid"][j], s.m["j_k"][j], s.m["j_d"][j] = 0.0, k, 0.06 * k / w
    if form(rng, 2):
        a = np.abs(np.gradient(s.seen["v"][:, s.body(joint["to"])], s.Ts))
        s.m["j_beta"][j], s.m["j_e0"][j], s.m["j_p"][j] = 0.8, 2.0 * far * float(np.quantile(a, 0.9)) / k, 1.0
    arrays.coordinates(s.m)
    arrays.bristles(s.m)
    return {"stiffness": k, "f_Hz": w / (2.0 * math.pi)}


@effect("structure.resonance", bodies, ("frequency",))
def resonance(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Resonance: a mass on a linear or hardening spring at the body."""
    i = s.body(node)
    f = about(rng, min(0.45 * s.band_hz, 30.0))
    added, w = about(rng, 0.3) * size * inertia_at(s, node), 2.0 * math.pi * f
    extra = arrays.add_body(s.m, added)
    k = added * w * w
    j = arrays.add_joint(s.m, i, extra, 1.0, k, 2.0 * about(rng, 0.02) * added * w)
    s.m["b_coord"][extra], s.m["b_ratio"][extra] = extra, 1.0
    if form(rng, 2):
        a = np.gradient(s.seen["v"][:, i], s.Ts)
        s.m["j_beta"][j], s.m["j_e0"][j] = 0.3, max(6.0 * float(np.std(a)) / w**2, 1e-12)
    return {"added": added, "f_Hz": f}


@effect("load.inertia", rotary_bodies, ("angle", "position"))
def inertia(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Inertia that varies with the angle of a crank or linkage, once or twice a turn."""
    i = s.body(node)
    share = inertia_at(s, node) / float(s.m["b_J"][i])
    a = min(about(rng, 0.45 * share), 0.8) * size
    n = float(1 + form(rng, 2))
    if span(s, node) * n < 2.0:
        raise UnfitError("the body does not turn far enough")
    s.m["b_Ja"][i], s.m["b_Jn"][i], s.m["b_Jp"][i] = a * sign(rng), n, rng.uniform(0.0, 2.0 * math.pi)
    return {"share": a, "per_turn": n}
