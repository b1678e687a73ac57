"""Unknown physics: effects without a name in the table. Any name in an answer is wrong."""

import math
from collections.abc import Callable

import numpy as np

from rtctl.proof.machines import arrays
from rtctl.proof.machines.effect import (
    Setup,
    UnfitError,
    about,
    bodies,
    command,
    crossed,
    drives,
    inertia_at,
    level,
    on_body,
    sign,
    span,
    speed,
    springs,
)  # fmt: skip

Maker = Callable[[Setup, str, float, np.random.Generator], dict[str, float]]
UNKNOWN: dict[str, tuple[Maker, Callable[[Setup], list[str]]]] = {}


def unknown(name: str, where: Callable[[Setup], list[str]]) -> Callable[[Maker], Maker]:
    def register(make: Maker) -> Maker:
        UNKNOWN["unknown." + name] = (make, where)
        return make

    return register


@unknown("eddy_brake", bodies)
def eddy_brake(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Eddy-current brake: force with a peak over speed."""
    i, peak, at = s.body(node), about(rng, 1.6 * level(s, node)) * size, about(rng, 0.3 * speed(s, node))
    s.m["b_eddy"][i], s.m["b_eddyv"][i] = peak, at
    return {"peak": peak, "at_speed": at}


@unknown("latch_wells", bodies)
def latch_wells(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Three irregular potential wells that hold the body."""
    i, width = s.body(node), about(rng, 0.03 * span(s, node))
    s.m["b_well"][i], s.m["b_wellw"][i] = about(rng, 2.0 * level(s, node)) * size, width
    s.m["b_wellat"][i] = [crossed(s, node, rng) + 3.0 * width * (k - 1) for k in range(arrays.NW)]
    return {"width": width}


@unknown("cross_flow", lambda s: bodies(s) if len(bodies(s)) > 1 else [])
def cross_flow(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Force by the product of two bodies' speeds, in one direction for any direction of motion."""
    i = s.body(node)
    other = next(b for b in bodies(s) if b != node)
    c = sign(rng) * about(rng, 1.6 * level(s, node) / (speed(s, node) * speed(s, other))) * size
    s.m["b_cross"][i], s.m["b_crossj"][i] = c, s.body(other)
    return {"c": c}


@unknown("wandering_friction", bodies)
def wandering(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Dry friction that varies with time."""
    i = s.body(node)
    F, f = about(rng, 0.9 * level(s, node)) * size, about(rng, 0.35, 0.8)
    s.m["b_wander"][i], s.m["b_wanderf"][i] = F, f
    return {"force": F, "f_Hz": f}


@unknown("loose_mass", bodies)
def loose_mass(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Loose mass between two stops."""
    i, J = s.body(node), about(rng, 0.35) * size * inertia_at(s, node)
    w = 2.0 * math.pi * about(rng, 25.0)
    extra = arrays.add_body(s.m, J)
    j = arrays.add_joint(s.m, i, extra, 1.0, J * w * w, 0.3 * J * w)
    s.m["j_gap"][j] = about(rng, 0.01 * span(s, node))
    s.m["b_B"][extra] = 0.2 * J
    return {"mass": J, "gap": float(s.m["j_gap"][j])}


@unknown("negative_damping", bodies)
def negative_damping(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Negative damping in a band of speeds."""
    i, v = s.body(node), about(rng, 0.45 * speed(s, node))
    s.m["b_neg"][i], s.m["b_negv"][i], s.m["b_negw"][i] = about(rng, 1.1 * level(s, node)) * size, v, 0.25 * v
    return {"at_speed": v}


@unknown("breathing_stiffness", springs)
def breathing(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Stiffness that oscillates with time."""
    j = s.joint(node)
    s.m["j_par"][j], s.m["j_parf"][j] = min(0.7 * size, 0.8), about(rng, 1.2, 0.8)
    s.m["j_k"][j] /= 1.0 + 0.5 * min(size, 1.0)
    return {"share": float(s.m["j_par"][j])}


@unknown("loose_screw", springs)
def loose_screw(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Joint without contact for some milliseconds after its force changed sign."""
    j = s.joint(node)
    T = s.seen["T"][:, j]
    if min(np.mean(T > 0.0), np.mean(T < 0.0)) < 0.05:
        raise UnfitError("the joint's force never changes its sign")
    s.m["j_loose"][j], s.m["j_loosetau"][j] = 0.9, about(rng, 0.01) * size
    return {"tau_s": float(s.m["j_loosetau"][j])}


@unknown("random_force", bodies)
def random_force(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    s.hidden.random_sd[s.body(node)] = about(rng, 0.6 * level(s, node)) * size
    s.hidden.random_tau = about(rng, 0.1, 1.0)
    return {"sd": float(s.hidden.random_sd[s.body(node)])}


@unknown("friction_spells", bodies)
def spells(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Intermittent dry friction at random times."""
    s.hidden.spot_F[s.body(node)] = about(rng, 1.3 * level(s, node)) * size
    s.hidden.spot_rate, s.hidden.spot_s = about(rng, 12.0 / (s.n * s.Ts)), about(rng, 0.3)
    return {"force": float(s.hidden.spot_F[s.body(node)])}


@unknown("relaxing_bumper", bodies)
def relaxing(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Spring with a slowly following anchor."""
    i = s.body(node)
    tau = about(rng, 0.5)
    k = about(rng, 1.2 * level(s, node) / min(speed(s, node) * tau, span(s, node))) * size
    s.m["b_relax"][i], s.m["b_relaxtau"][i] = k, tau
    return {"k": k, "tau_s": tau}


@unknown("supply_pulse", drives)
def supply_pulse(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Gain that oscillates with time."""
    d = s.drive(node)
    s.m["d_pulse"][d], s.m["d_pulsef"][d] = min(about(rng, 0.4) * size, 0.8), about(rng, 5.0, 0.8)
    return {"share": float(s.m["d_pulse"][d])}


@unknown("crosstalk", lambda s: on_body(s, "position", "speed"))
def crosstalk(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Crosstalk of the command into the reading."""
    first = drives(s)[0]
    s.m["s_cross"][s.sensor(node)] = sign(rng) * about(rng, 12.0 / command(s, first)) * size
    return {"quanta_per_unit": float(s.m["s_cross"][s.sensor(node)])}


@unknown("sensor_walk", lambda s: on_body(s, "position"))
def sensor_walk(s: Setup, node: str, size: float, rng: np.random.Generator) -> dict[str, float]:
    """Random walk of the zero of the reading."""
    s.hidden.walk[s.sensor(node)] = about(rng, 30.0) * size
    return {"quanta_per_root_s": float(s.hidden.walk[s.sensor(node)])}
