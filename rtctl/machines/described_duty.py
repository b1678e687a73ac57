"""Nominal duty of a described machine, by the reference of its config: travel and speed of each node."""

from math import inf
from typing import Any

import numpy as np

from rtctl.laws import reference
from rtctl.machines.described_motion import mechanics
from rtctl.machines.described_parts import parts_of
from rtctl.machines.duty import Duty, Use
from rtctl.machines.reference_motion import Motion, motion
from rtctl.plants.graph.description import Description

QUICK = 5.0  # 1/s, acceleration divided by the nominal speed


def duty(config: Any) -> Duty:
    """Nominal duty. Raises ValueError where the reference does not move."""
    table = reference.build(config.reference, 1.0 / config.loop.rate)
    t, r = table.t[: table.n], table.r[: table.n]
    travel = float(np.ptp(r))
    if travel == 0.0:
        raise ValueError("reference: it does not move, and the nominal duty follows from its motion")
    slope = np.abs(np.diff(r)[np.diff(t) > 0] / np.diff(t)[np.diff(t) > 0])
    speed = float(slope.max()) if slope.size and slope.max() > 0.0 else travel
    return Duty(speed, travel, float(t[-1]) + 1.0, _use, _volts)


def _use(node: str, config: Any) -> Use:
    """Nominal duty of a node, in the node's unit."""
    found, made = duty(config), mechanics(config, 1.0 / config.loop.rate)
    moved, machine = motion(made), parts_of(config).machine
    body = _body(machine, node, parts_of(config).feedback)
    ratio = abs(float(made.rows[body] @ moved.phi)) or 1.0
    inertia = _inertia(moved)
    force = float(np.hypot(inertia * found.speed * QUICK, _dry(moved, made)))
    joint = machine.joints.get(node)
    return Use(
        speed=found.speed * ratio,
        travel=found.travel * ratio,
        force=force / ratio,
        dry=machine.bodies[body].dry,
        inertia=inertia / ratio**2,
        stiffness=float(joint.stiffness or 0.0) if joint is not None else 0.0,
        contact=inf,
        slides=not machine.turns(body),
    )


def _volts(config: Any) -> float:
    """Command of the nominal duty, rms."""
    made = mechanics(config, 1.0 / config.loop.rate)
    moved = motion(made)
    force = np.hypot(_inertia(moved) * duty(config).speed * QUICK, _dry(moved, made))
    return float(force / abs(moved.phi @ moved.plus))


def _body(machine: Description, node: str, feedback: str) -> str:
    """Body of a node: the far end of a joint, the body of a drive or sensor, else the body of the feedback."""
    if node in machine.bodies:
        return node
    for group in (machine.drives, machine.sensors):
        body = getattr(group.get(node), "body", None)
        if body is not None:
            return str(body)
    if node in machine.joints:
        joint = machine.joints[node]
        return str(joint.to if not machine.is_frame(joint.to) else getattr(joint, "from"))
    return str(machine.sensors[feedback].body)


def _inertia(moved: Motion) -> float:
    return float(moved.phi @ (moved.M * moved.phi))


def _dry(moved: Motion, made: Any) -> float:
    return float(np.abs(moved.phi) @ made.graph.dry[: made.graph.nq])
