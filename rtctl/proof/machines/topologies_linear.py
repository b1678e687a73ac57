"""Topologies of linear machines: belt axis, ball screw, hoist, gantry, axis with only a scale."""

import math

import numpy as np

from rtctl.proof.machines.draft import (
    Draft,
    Driver,
    Json,
    between,
    both,
    encoder,
    pick,
    scale,
    spring,
    topology,
    wants_rigid,
)  # fmt: skip


@topology("belt")
def belt(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    n = pick(rng, 0.00955, 0.0127, 0.0159, 0.0191)
    mass = between(rng, 0.6, 3.0)
    bodies: dict[str, Json] = {
        "motor": {"inertia": between(rng, 0.15, 0.6) * mass * n * n, "dry": between(rng, 0.1, 0.3) * n * 15.0,
                  "viscous": between(rng, 0.8e-5, 4e-5)},
        "carriage": {"mass": mass, "dry": between(rng, 1.2, 4.5)},
    }  # fmt: skip
    joints = {"belt": spring(rng, bodies, "motor", "carriage", n, (90.0, 260.0), wants_rigid(rng, need, 0.15))}
    first, second = both(rng, need, (0.45, 0.4, 0.15))
    sensors = {"encoder": encoder(rng, "motor", "encoder_counts")} if first else {}
    if second:
        sensors["scale"] = scale(rng, "carriage", "scale_counts")
    fast = between(rng, 0.3, 1.0) / (n if first else 1.0)
    reach = between(rng, 0.2, 0.5) / (n if first else 1.0)
    return Draft("Belt axis: motor, toothed belt, carriage on rails.", bodies, joints, sensors, next(iter(sensors)),
                 [Driver("amplifier", "motor")], fast, 0.25 * reach, reach)  # fmt: skip


@topology("screw")
def screw(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    lead = pick(rng, 0.005, 0.01, 0.016, 0.02) / (2.0 * math.pi)
    mass = between(rng, 4.0, 30.0)
    J = between(rng, 0.5, 2.5) * mass * lead * lead
    bodies: dict[str, Json] = {
        "motor": {"inertia": between(rng, 0.5, 2.0) * J, "dry": between(rng, 2.0, 5.0) * lead * 4.0,
                  "viscous": between(rng, 2.0, 8.0) * lead * 0.02},
        "screw": {"inertia": J, "dry": between(rng, 2.0, 5.0) * lead * 4.0},
        "table": {"mass": mass, "dry": between(rng, 8.0, 30.0), "viscous": between(rng, 10.0, 60.0)},
    }  # fmt: skip
    for name in ("motor", "screw"):
        bodies[name] = {k: float(f"{v:.6g}") for k, v in bodies[name].items()}
    coupling = spring(rng, bodies, "motor", "screw", 1.0, (150.0, 320.0), wants_rigid(rng, need, 0.15))
    nut = spring(rng, bodies, "screw", "table", lead, (110.0, 260.0), wants_rigid(rng, need, 0.3))
    first, second = both(rng, need, (0.4, 0.45, 0.15))
    sensors = {"encoder": encoder(rng, "motor", "encoder_counts")} if first else {}
    if second:
        sensors["scale"] = scale(rng, "table", "scale_counts")
    fast = between(rng, 0.08, 0.3) / (lead if first else 1.0)
    reach = between(rng, 0.1, 0.3) / (lead if first else 1.0)
    return Draft("Ball screw: motor, coupling, screw, table on rails.", bodies, {"coupling": coupling, "nut": nut},
                 sensors, next(iter(sensors)), [Driver("amplifier", "motor")], fast, 0.2 * reach, reach)  # fmt: skip


@topology("hoist")
def hoist(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    n = between(rng, 0.03, 0.06)
    mass = between(rng, 3.0, 12.0)
    bodies: dict[str, Json] = {
        "drum": {"inertia": between(rng, 0.3, 1.2) * mass * n * n, "dry": between(rng, 0.02, 0.06) * mass * 9.81 * n,
                 "viscous": between(rng, 0.002, 0.01)},
        "load": {"mass": mass, "dry": between(rng, 0.01, 0.04) * mass * 9.81, "gravity": {"incline": 1.570796}},
    }  # fmt: skip
    joints = {"rope": spring(rng, bodies, "drum", "load", float(f"{n:.4g}"), (9.0, 40.0), False)}
    first, second = both(rng, need, (0.5, 0.5, 0.0))
    sensors = {"encoder": encoder(rng, "drum", "encoder_counts")} if first else {}
    if second:
        sensors["height"] = scale(rng, "load", "height_counts")
    fast, reach = between(rng, 0.25, 0.7) / n, between(rng, 0.3, 0.6) / n
    return Draft("Hoist: motor with drum, rope, load that hangs and is guided.", bodies, joints, sensors,
                 next(iter(sensors)), [Driver("amplifier", "drum", kinds=("force", "current"))], fast, 0.25 * reach,
                 reach, loop_hz=(1.5, 3.0))  # fmt: skip


@topology("gantry")
def gantry(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    n = pick(rng, 0.0127, 0.0159, 0.0191)
    mass = between(rng, 3.0, 9.0)
    J = between(rng, 0.1, 0.3) * mass * n * n
    bodies: dict[str, Json] = {
        "motor1": {"inertia": J, "dry": between(rng, 0.5, 1.5) * n, "viscous": 0.02 * n},
        "motor2": {"inertia": J * between(rng, 0.9, 1.1), "dry": between(rng, 0.5, 1.5) * n, "viscous": 0.02 * n},
        "beam": {"mass": mass, "dry": between(rng, 3.0, 9.0)},
    }
    joints = {
        "belt1": spring(rng, bodies, "motor1", "beam", n, (70.0, 160.0), False),
        "belt2": spring(rng, bodies, "motor2", "beam", n, (70.0, 160.0), False),
        "shaft": spring(rng, bodies, "motor1", "motor2", 1.0, (25.0, 70.0), False),
    }
    sensors = {"encoder1": encoder(rng, "motor1", "encoder1_counts")}
    sensors["encoder2"] = sensors["encoder1"] | {"body": "motor2", "column": "encoder2_counts"}
    if rng.random() < 0.5:
        sensors["scale"] = scale(rng, "beam", "scale_counts")
    kinds = (("force", "current", "voltage")[rng.integers(3)],)
    drivers = [Driver(f"amplifier{k}", f"motor{k}", 0.5, kinds=kinds) for k in (1, 2)]
    fast, reach = between(rng, 0.3, 0.9) / n, between(rng, 0.2, 0.5) / n
    return Draft("Gantry: two motors with belts on one beam, joined by a shaft.", bodies, joints, sensors, "encoder1",
                 drivers, fast, 0.25 * reach, reach)  # fmt: skip


@topology("axis")
def axis(rng: np.random.Generator, need: frozenset[str]) -> Draft:
    mass = between(rng, 1.0, 60.0)
    bodies: dict[str, Json] = {"slide": {"mass": mass, "dry": between(rng, 0.2, 0.8) * mass**0.6 * 3.0,
                        "viscous": between(rng, 0.3, 2.0) * mass}}  # fmt: skip
    if rng.random() < 0.25:
        bodies["slide"]["gravity"] = {"incline": float(f"{rng.choice([-1, 1]) * rng.uniform(0.1, 0.6):.4g}")}
    sensors = {"scale": scale(rng, "slide", "scale_counts")}
    reach = between(rng, 0.08, 0.3)
    return Draft("Slide with a linear motor and a scale.", bodies, {}, sensors, "scale", [Driver("amplifier", "slide")],
                 between(rng, 0.2, 1.0), 0.25 * reach, reach)  # fmt: skip
