"""Friction effects of bodies: dry, viscous, Stribeck, presliding, by direction, load, position, and drag."""

import math

import numpy as np

from rtctl.proof.machines import arrays
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
    level,
    sign,
    span,
    speed,
)  # fmt: skip
from rtctl.proof.machines.kinematics import rotary


@effect("friction.coulomb", bodies, ("velocity",))
def coulomb(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Dry friction beyond the tolerance, in one bristle or spread over bristles of several lengths."""
    i = s.body(node)
    added = about(rng, 0.7 * level(s, node)) * size
    s.m["b_F"][i] += added
    if form(rng, 2):
        s.m["b_law"][i] = arrays.IWAN
    return {"F_C": float(s.m["b_F"][i]), "F_added": added}


@effect("friction.viscous", bodies, ("velocity",))
def viscous(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    B = about(rng, max(0.9 * level(s, node) / speed(s, node), 1.2 * float(s.m["b_B"][s.body(node)]))) * size
    s.m["b_B"][s.body(node)] += B
    return {"B": B}


@effect("friction.stribeck", bodies, ("velocity",))
def stribeck(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Stribeck friction: Gaussian, exponential or rational fall with speed."""
    i = s.body(node)
    top, v_s = about(rng, 0.9 * level(s, node)) * size, about(rng, 0.12 * speed(s, node), 0.6)
    s.m["b_Fs"][i], s.m["b_vs"][i], s.m["b_fall"][i] = top, v_s, float(form(rng, 3))
    F_C = float(s.m["b_F"][i])
    return {"F_C": F_C, "F_s": F_C + top, "v_s": v_s}


@effect("friction.presliding", bodies, ("position", "velocity", "angle"))
def presliding(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Visible presliding: Dahl bristle, or several bristles of different lengths."""
    i = s.body(node)
    s.m["b_F"][i] = max(float(s.m["b_F"][i]), 0.3 * level(s, node))
    w, J = 2.0 * math.pi * about(rng, 7.0), inertia_at(s, node)
    travel = float(s.m["b_F"][i]) / (J * w * w) * size
    s.m["b_sigma"][i] = float(s.m["b_F"][i]) / travel
    s.m["b_damp"][i] = 0.2 * math.sqrt(float(s.m["b_sigma"][i]) * J)
    s.m["b_law"][i] = arrays.DAHL if form(rng, 2) else arrays.IWAN
    return {"travel": travel, "F_C": float(s.m["b_F"][i])}


@effect("friction.asymmetry", bodies, ("velocity",))
def asymmetry(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Friction that differs by direction: dry, viscous or both."""
    i = s.body(node)
    kind, F = form(rng, 3), 0.8 * level(s, node)
    by_speed = float(s.m["b_B"][i]) * speed(s, node)
    dry = min(about(rng, F / max(float(s.m["b_F"][i]), 1e-12)), 0.9) * size * sign(rng) if kind != 1 else 0.0
    share = min(about(rng, F / max(by_speed, 1e-12)), 0.9) * size * sign(rng) if kind != 0 else 0.0  # never drives
    if abs(dry) * float(s.m["b_F"][i]) + abs(share) * by_speed < 0.2 * F * size:
        raise UnfitError("too little friction for an asymmetry of it")
    B = share * float(s.m["b_B"][i])
    s.m["b_as"][i], s.m["b_Bas"][i] = dry, B
    return {"asymmetry": dry, "viscous_asymmetry": B}


def _loaded(s: Setup) -> list[str]:
    """Bodies at the end of a spring, or under gravity."""
    out = {e for j in s.machine["joints"].values() if "stiffness" in j for e in (j["from"], j["to"])}
    return [b for b in bodies(s) if b in out or "gravity" in s.machine["bodies"][b]]


@effect("friction.load", _loaded, ("tension", "velocity", "position"))
def by_load(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Friction proportional to the forces in the body's joints, or to its gravity load."""
    i = s.body(node)
    ends = [(name, j) for name, j in s.machine["joints"].items() if node in (j["from"], j["to"]) and "stiffness" in j]
    forces = [joint_force(s, n) * (1.0 if j["to"] == node else abs(j["ratio"])) for n, j in ends]
    weight = float(np.abs(s.m["b_g"][i]).max() + abs(s.m["b_gc"][i]))
    if weight > 0.0 and (not forces or form(rng, 2)):
        if s.m["b_gc"][i] != 0.0:
            raise UnfitError("a constant load gives constant friction")
        lean = float(np.std(np.abs(np.sin(s.seen["q"][:, i] + s.m["b_ga"][i, 0]))))
        mu = about(rng, 0.9 * level(s, node) / (weight * max(lean, 0.1))) * size
        s.m["b_mu_g"][i] = min(mu, 0.6)
        return {"mu": float(s.m["b_mu_g"][i])}
    if not forces:
        raise UnfitError("no force in a joint here")
    mu = min(about(rng, 0.8 * level(s, node) / max(forces)), 0.5) * size
    s.m["b_mu"][i] = mu
    return {"mu": mu}


@effect("friction.quadratic", bodies, ("velocity",))
def quadratic(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Drag proportional to the square of speed, or to a power near 2."""
    i, power = s.body(node), (2.0, 1.8)[form(rng, 2)]
    c = about(rng, 1.1 * level(s, node) / speed(s, node) ** power) * size
    s.m["b_quad"][i], s.m["b_power"][i] = c, power
    return {"c": c, "power": power}


@effect("friction.position", bodies, ("position", "angle"))
def by_position(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Dry friction by position: a wave, a rounded step, or a worn spot."""
    i, kind = s.body(node), form(rng, 3)
    F, wide = about(rng, 1.1 * level(s, node)) * size, span(s, node)
    low = float(s.seen["q"][:, i].min())
    if rotary(s.machine, node) and wide > 12.0:  # many turns: period of one turn
        kind, width = 0, 1.0
    else:
        width = (wide / about(rng, 8.0), 0.2 * wide, about(rng, 0.12 * wide))[kind]
    s.m["b_pF"][i], s.m["b_pform"][i], s.m["b_pw"][i] = F, float(kind), width
    s.m["b_pat"][i] = low + wide * rng.uniform(0.35, 0.65)
    return {"force": F, "width": width, "at": float(s.m["b_pat"][i])}
