"""Effects of forces by position at bodies: cogging, imbalance, springs, bumps, undescribed gravity."""

import math

import numpy as np

from rtctl.proof.machines.effect import (
    Setup,
    Sizes,
    UnfitError,
    about,
    bodies,
    crossed,
    effect,
    form,
    level,
    rotary_bodies,
    sign,
    span,
)  # fmt: skip
from rtctl.proof.machines.kinematics import rotary


@effect("ripple.cogging", rotary_bodies, ("angle", "position"))
def cogging(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Torque periodic in the angle: one harmonic, or three."""
    i, wide = s.body(node), span(s, node)
    least = math.ceil(6.0 / max(wide, 1e-9))
    if least > 48:
        raise UnfitError("the body hardly turns")
    n = float(rng.choice([k for k in (4, 6, 7, 8, 12, 14, 24, 36, 48) if k >= least]))
    A = about(rng, 1.2 * level(s, node)) * size
    for h in range(1 + 2 * form(rng, 2)):
        s.m["b_cog"][i, h], s.m["b_cogn"][i, h] = A * 0.4**h, n * (h + 1)
        s.m["b_coga"][i, h] = rng.uniform(0.0, 2.0 * math.pi)
    return {"amplitude": A, "per_turn": n}


@effect("load.imbalance", rotary_bodies, ("angle", "position"))
def imbalance(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Imbalance under gravity: a torque with one period per turn and unknown angle."""
    if span(s, node) < 1.2:
        raise UnfitError("less than a fifth of a turn")
    i, A = s.body(node), about(rng, 1.1 * level(s, node)) * size
    angle = rng.uniform(-math.pi, math.pi)
    if "gravity" in s.machine["bodies"][node] and abs(math.sin(angle)) < 0.5:
        angle = math.pi / 2.0  # other angles equal a wrong mass or arm
    s.m["b_im"][i], s.m["b_ima"][i] = A, angle
    return {"amplitude": A, "angle": angle}


@effect("load.gravity", bodies, ("position", "angle", "time", "command"))
def gravity(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Gravity missing in the description: a hanging mass, or an incline."""
    i = s.body(node)
    if "gravity" in s.machine["bodies"][node]:
        raise UnfitError("gravity of this body is described")
    F = about(rng, 0.9 * level(s, node)) * size
    if rotary(s.machine, node):
        if span(s, node) < 1.0 or span(s, node) > 60.0:
            raise UnfitError("turns too little or as a spindle does")
        angle = rng.uniform(-0.6, 0.6)
        s.m["b_gx"][i], s.m["b_gxa"][i] = F, angle
        return {"amplitude": F, "angle": angle}
    s.m["b_gxc"][i] = F * sign(rng)
    return {"force": float(s.m["b_gxc"][i])}


@effect("load.spring", bodies, ("position",))
def spring(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Spring force by position: linear, hardening, or saturating (a cable chain)."""
    i, wide = s.body(node), span(s, node)
    if rotary(s.machine, node) and wide > 400.0:
        raise UnfitError("a spindle has no spring")
    k, kind = about(rng, 2.2 * level(s, node) / wide) * size, form(rng, 3)
    x0 = float(np.mean(s.seen["q"][:, i])) + 0.3 * wide * float(rng.uniform(-1.0, 1.0))
    s.m["b_k"][i], s.m["b_x0"][i] = k, x0
    if kind == 1:
        s.m["b_k"][i], s.m["b_k3"][i] = 0.6 * k, 2.5 * k / wide**2
    elif kind == 2:
        s.m["b_ksat"][i] = 0.4 * k * wide
    return {"k": k, "x0": x0}


@effect("load.bump", bodies, ("position", "angle"))
def bump(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Local force at one position: bell-shaped, or with finite width."""
    i, wide = s.body(node), span(s, node)
    if rotary(s.machine, node) and wide > 400.0:
        raise UnfitError("a spindle passes one position once")
    F, at = about(rng, 2.0 * level(s, node)) * size * sign(rng), crossed(s, node, rng)
    width = about(rng, 0.018 * wide)
    s.m["b_hump"][i], s.m["b_humpat"][i], s.m["b_humpw"][i] = F, at, width
    s.m["b_humpform"][i] = float(form(rng, 2))
    return {"force": F, "at": at, "width": width}
