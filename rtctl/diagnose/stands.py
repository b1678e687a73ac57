"""Where something stands that has no name: each body is pushed in turn, and the other sensors say which push was right.

What is missing at a motor pulls at its own tape, and the tape stretches. A push at the other motor keeps the capstan on
track as well, but it stretches the other tape, and both reels are seen away from where they were.

What pushes a body moves it smoothly, since it has inertia: a correction that is FASTER takes most of the error off, and
the other sensors come right as well. Where it is the reading that is off, the error stays, and a model that follows the
reading takes the other sensors away from what they saw.
"""

from copy import copy

import numpy as np

from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import per_unit

MOTORS = ("motor1", "motor2")
FASTER = 3.0  # than the correction that fits are made with
STAYS = 0.57  # of the error and of the reels' together, under the faster correction: then it is the reading
APART = 2.0  # times the error of the encoder, on the way: by so much is the scale off where the encoder misreads
TOGETHER = {  # bodies on one shaft or a stiff train: a push at one is a push at the other, where most is amiss
    "ivu": {"reel1": "motor1", "reel2": "motor2"},
    "ldu": {"motor": "carriage", "wheel": "carriage", "capstan": "carriage"},
}
MOSTLY = 0.5  # share of the error that a guess must explain to be believed about where it stands


def stands(problem: Problem, model: Model, guess: str, share: float) -> str:
    """The node, where the nearest `guess` explains this `share` of the error: that is believed if it moves with the
    body that was found, or where no other sensor tells of bodies."""
    plant = problem.sim.record.plant
    node = {"ivu": of_reels, "ldu": of_scale}.get(plant, of_one)(problem, model)
    guess = TOGETHER.get(plant, {}).get(guess, guess)
    if share < MOSTLY or node == "encoder":
        return node or "capstan"
    return node if node in MOTORS and guess[-1:] != node[-1:] else guess


def of_one(problem: Problem, model: Model) -> str:
    """Of a machine with one body and one sensor."""
    return "carriage"


def of_scale(problem: Problem, model: Model) -> str:
    """Of the linear drive: the encoder where the scale, which it should agree with, does not."""
    e = list(problem.by_sensor(problem.residual(model)).values())
    if len(e) < 2:
        return "carriage"
    turn, way = per_unit(problem.sim.record.case)
    unit = problem.sigma * [model.base["R_c"] / turn, 1.0 / way]
    main, other = (float(np.std(x)) * u for x, u in zip(e, unit, strict=True))
    return "encoder" if other > APART * main else "carriage"


def of_reels(problem: Problem, model: Model) -> str:
    """Of two reels: the motor whose push leaves the least error in the reels, or the encoder; empty without reels."""
    if not problem.edges:
        return ""
    quick = copy(problem)
    quick.sim = copy(problem.sim)
    quick.sim.follow = FASTER * problem.sim.follow
    slow, fast = ({node: powers(p, model, node) for node in MOTORS} for p in (problem, quick))
    node = min(fast, key=lambda node: fast[node][1])
    main, reels = fast[node][0] / slow[node][0], fast[node][1] / min(reels for _, reels in slow.values())
    return "encoder" if np.sqrt(main) * reels > STAYS else node


def powers(problem: Problem, model: Model, node: str) -> tuple[float, float]:
    """Mean squares of the main sensor's error and, together, of the reels', under a push at a body."""
    main, *reels = problem.by_sensor(problem.residual(model, at=node)).values()
    return float(np.mean(main**2)), sum(float(np.mean(e**2)) for e in reels)
