"""Machine of a kinematic problem: positions that follow the first position through the joints, without measured forces.

Forces are neither known nor fitted. A rigid joint of the description becomes a spring, too stiff for its deflection to
show in a reading, at which backlash and an uneven ratio can act. A body without friction would coast through backlash:
it gets dry friction whose effect no reading shows.

Source: Lurie & Enright, Classical feedback control (2000), for the play operator: the follower rests until it is moved.
"""

import numpy as np
from scipy.signal import savgol_filter

from rtctl.case.graph_case import GraphCase
from rtctl.diagnose.model.model import rigid
from rtctl.plants.graph.layout import layout

QUICK = (1000.0, 3000.0)  # rad/s, natural frequency of a stiff joint: least and most
QUICK_OF_ROW = 30.0  # rad a row, highest natural frequency that a slow recording needs
DAMPED = 1.4  # twice the damping ratio of a stiff joint
SLIGHT = 0.05  # steps of the reading: largest deflection of a stiff joint by friction
BRAKES = 2.0  # dry friction over the inertial force of the given motion, so that no follower coasts
OVER = 7  # rows of the window of an acceleration


def followed(case: GraphCase, main: str, fine: dict[str, float], x: np.ndarray, dt: float) -> GraphCase:
    """Case with a spring for each rigid joint and dry friction for each body without friction.

    `main` is the sensor of the given motion x (n,), rad or m; `fine` is the step or noise of each reading, SI.
    """
    machine, values, given = case.machine, dict(case.values), set(case.values)
    own = str(machine.sensors[main].body)
    bends = np.quantile(np.abs(savgol_filter(x, OVER, 3, deriv=2, delta=dt)), 0.999) if len(x) >= OVER else 0.0
    ratios = rigid(case.layout, values, own)
    joints, bodies = dict(machine.joints), dict(machine.bodies)
    needs = [BRAKES * bends * abs(ratios.get(str(machine.sensors[s].body), 0.0)) / (SLIGHT * fine[s])
             for s in fine if s != main and fine[s] > 0.0]  # fmt: skip
    quick = float(np.clip(np.sqrt(max(needs, default=0.0)), min(QUICK[0], QUICK_OF_ROW / dt), QUICK[1]))
    for name, joint in machine.joints.items():
        if joint.stiffness is None:
            ends = [end for end in (getattr(joint, "from"), joint.to) if end in ratios]
            mass = max(_felt(case, end, joint.to) for end in ends if end != own or len(ends) == 1)
            made = {"stiffness": quick**2 * mass, "damping": DAMPED * quick * mass}
            joints[name] = joint.model_copy(update=made)
            for key, value in made.items():
                values[f"joints.{name}.{key}"] = value
                given.discard(f"joints.{name}.{key}")
    for name, body in machine.bodies.items():
        if name != own and not machine.is_frame(name) and body.dry == 0.0:
            mass = values[f"bodies.{name}.{'inertia' if body.turns else 'mass'}"]
            dry = mass * max(BRAKES * abs(ratios[name]) * float(bends), 1e-12)
            bodies[name] = body.model_copy(update={"dry": dry})
            values[f"bodies.{name}.dry"] = dry
            given.discard(f"bodies.{name}.dry")
    changed = machine.model_copy(update={"joints": joints, "bodies": bodies})
    taken = tuple(path for path in values if path not in given)
    return case._replace(machine=changed, layout=layout(changed), values=values, made=taken)


def _felt(case: GraphCase, name: str, far: str) -> float:
    """Inertia or mass of one end of a joint, reflected to the far end, kg m^2 or kg."""
    body = case.machine.bodies[name]
    mass = case.values[f"bodies.{name}.{'inertia' if body.turns else 'mass'}"]
    ends = [case.layout.ratio(end, case.values) for end in (name, far)]
    return float(mass * (ends[0] / ends[1]) ** 2) if all(ends) else float(mass)
