"""Topologies of rotary machines: geared arm, torsional line, pendulum, spindle, two motors on one table."""

import numpy as np

from rtctl.proof.machines.draft import (
    TWO,
    Draft,
    Driver,
    Json,
    between,
    both,
    encoder,
    pick,
    spring,
    topology,
    wants_rigid,
)  # fmt: skip


def _hanging(rng: np.random.Generator, mass: float, arm: float, open_loop: bool) -> Json:
    """Gravity of a pendulum that starts at its lowest point, or at another angle under control."""
    angle = 0.0 if open_loop or rng.random() < 0.8 else round(float(rng.uniform(-0.8, 0.8)), 3)
    return {"mass": mass, "arm": arm, "angle": angle}


@topology("arm")
def arm(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    gear = pick(rng, 20.0, 30.0, 50.0, 80.0)
    mass, r = between(rng, 0.8, 3.0), between(rng, 0.12, 0.3)
    J = mass * r * r * rng.uniform(1.15, 1.7)
    bodies: dict[str, Json] = {
        "motor": {
            "inertia": between(rng, 0.2, 1.2) * J / gear**2,
            "dry": between(rng, 0.05, 0.2) * mass * r * 9.81 / gear,
            "viscous": between(rng, 2e-5, 8e-5),
        },
        "arm": {
            "inertia": J,
            "dry": between(rng, 0.03, 0.12) * mass * r * 9.81,
            "gravity": _hanging(rng, mass, r, False),
        },
    }
    joints = {"gear": spring(rng, bodies, "motor", "arm", 1.0 / gear, (14.0, 45.0), wants_rigid(rng, need, 0.2))}
    first, second = both(rng, need, (0.5, 0.5, 0.0))
    sensors = {"encoder": encoder(rng, "motor", "encoder_counts")} if first else {}
    if second:
        sensors["link"] = encoder(rng, "arm", "link_counts", 8.0)
    return Draft("Geared arm: motor, gear, arm under gravity.", bodies, joints, sensors, next(iter(sensors)),
                 [Driver("amplifier", "motor")], between(rng, 1.2, 4.0) * gear, 0.5 * gear, 1.9 * gear,
                 loop_hz=(2.5, 4.5))  # fmt: skip


@topology("torsion")
def torsion(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    bodies: dict[str, Json] = {
        "motor": {
            "inertia": between(rng, 1e-3, 3e-3),
            "dry": between(rng, 0.012, 0.03),
            "viscous": between(rng, 5e-4, 2e-3),
        },
        "middle": {"inertia": between(rng, 1e-3, 3e-3), "dry": between(rng, 0.004, 0.01)},
        "load": {
            "inertia": between(rng, 1e-3, 3e-3),
            "dry": between(rng, 0.004, 0.01),
            "viscous": between(rng, 2e-4, 8e-4),
        },
    }
    joints = {"shaft1": spring(rng, bodies, "motor", "middle", 1.0, (14.0, 40.0), False, (0.01, 0.03)),
              "shaft2": spring(rng, bodies, "middle", "load", 1.0, (14.0, 40.0), False, (0.01, 0.03))}  # fmt: skip
    sensors = {"encoder1": encoder(rng, "motor", "encoder1_counts")}
    if TWO in need or rng.random() < 0.75:
        sensors["encoder3"] = encoder(rng, "load", "encoder3_counts")
    if rng.random() < 0.25:
        sensors["encoder2"] = encoder(rng, "middle", "encoder2_counts")
    reach = between(rng, 3.0, 20.0)
    return Draft("Torsional line of three inertias.", bodies, joints, sensors, "encoder1",
                 [Driver("amplifier", "motor")], between(rng, 4.0, 20.0), 0.25 * reach, reach, open_share=0.3,
                 loop_hz=(1.5, 2.5))  # fmt: skip


@topology("pendulum")
def pendulum(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    mass, r = between(rng, 0.3, 2.0), between(rng, 0.1, 0.35)
    weight = mass * r * 9.81
    g = _hanging(rng, mass, r, False)
    body: Json = {
        "inertia": mass * r * r * rng.uniform(1.1, 1.6),
        "dry": between(rng, 0.006, 0.03) * weight,
        "viscous": between(rng, 0.001, 0.006) * weight,
        "gravity": g,
    }
    if rng.random() < 0.3:
        body["gravity"] = [g, {"mass": -0.5 * mass, "arm": between(rng, 0.4, 0.7) * r, "angle": g["angle"]}]
    bodies: dict[str, Json] = {"pendulum": body}
    sensors = {"encoder": encoder(rng, "pendulum", "encoder_counts", 2.0)}
    fast = between(rng, 2.0, 8.0)
    words = "Direct-drive pendulum under gravity."
    return Draft(words, bodies, {}, sensors, "encoder", [Driver("amplifier", "pendulum")], fast, 0.8, 2.4,
                 open_share=0.25 if g["angle"] == 0.0 else 0.0, loop_hz=(3.0, 6.0))  # fmt: skip


@topology("spindle")
def spindle(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    J = between(rng, 1e-4, 6e-4)
    bodies: dict[str, Json] = {
        "rotor": {"inertia": J, "dry": between(rng, 0.004, 0.012), "viscous": between(rng, 1e-5, 4e-5)}
    }
    joints: dict[str, Json] = {}
    if rng.random() < 0.4 or "elastic" in need or "rigid" in need:
        bodies["impeller"] = {"inertia": between(rng, 0.6, 2.0) * J, "dry": between(rng, 0.002, 0.008),
                              "viscous": between(rng, 1e-5, 4e-5)}  # fmt: skip
        joints["shaft"] = spring(
            rng, bodies, "rotor", "impeller", 1.0, (30.0, 90.0), wants_rigid(rng, need, 0.2), (0.015, 0.04)
        )
    sensors: dict[str, Json] = {}
    by_speed = TWO not in need and rng.random() < 0.6
    if by_speed:
        sensors["tacho"] = {
            "body": "rotor",
            "measures": "speed",
            "column": "rpm",
            "resolution": pick(rng, 0.1, 0.5, 1.0),
            "per_unit": 9.5492966,
        }
    else:
        sensors["encoder"] = encoder(rng, "rotor", "encoder_counts")
    if TWO in need:
        sensors["encoder2"] = encoder(rng, "impeller" if joints else "rotor", "encoder2_counts")
    top = between(rng, 80.0, 350.0)
    return Draft("Spindle or fan.", bodies, joints, sensors, next(iter(sensors)),
                 [Driver("bridge", "rotor", kinds=("voltage", "voltage", "current"))], top,
                 (0.5 if by_speed else 6.0) * top, (1.0 if by_speed else 40.0) * top, open_share=0.5,
                 loop_hz=(1.5, 3.5), rates=(500.0, 1000.0), speed_loop=by_speed,
                 one_way=bool(by_speed and rng.random() < 0.5))  # fmt: skip


@topology("two-motor")
def two_motor(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    gear = pick(rng, 6.0, 8.0, 10.0, 15.0)
    J = between(rng, 0.02, 0.2)
    bodies: dict[str, Json] = {}
    for k in (1, 2):
        bodies[f"motor{k}"] = {
            "inertia": between(rng, 0.15, 0.5) * J / gear**2,
            "dry": between(rng, 0.02, 0.08) * J / gear * 20.0,
            "viscous": between(rng, 1e-5, 5e-5),
        }
    bodies["table"] = {"inertia": J, "dry": between(rng, 0.5, 2.0) * J * 5.0}
    joints = {f"gear{k}": spring(rng, bodies, f"motor{k}", "table", 1.0 / gear, (35.0, 90.0), False) for k in (1, 2)}
    sensors = {"encoder1": encoder(rng, "motor1", "encoder1_counts")}
    if rng.random() < 0.6 and TWO not in need:
        sensors["encoder2"] = sensors["encoder1"] | {"body": "motor2", "column": "encoder2_counts"}
    if TWO in need or rng.random() < 0.6:
        sensors["table_encoder"] = encoder(rng, "table", "table_counts", 5.0)
    kinds = (("force", "current")[rng.integers(2)],)
    pre = float(rng.uniform(0.15, 0.35))
    drivers = [Driver("amplifier1", "motor1", 0.5, pre, kinds), Driver("amplifier2", "motor2", 0.5, -pre, kinds)]
    return Draft("Rotary table with two motors that are preloaded against each other.", bodies, joints, sensors,
                 "encoder1", drivers, between(rng, 1.5, 6.0) * gear, 0.5 * gear, 2.5 * gear,
                 loop_hz=(1.5, 3.0))  # fmt: skip
