"""Where something stands that has no name."""

import numpy as np
import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.case import read_case
from rtctl.diagnose.kernel import CLOSED, OPEN
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator, gear
from rtctl.diagnose.stands import stands
from rtctl.plants.physics import TERMS

REELS = ("capstan_counts", "reel1_counts", "reel2_counts")


def counter(way):
    """Counts of a sensor that cannot tell direction."""
    return np.concatenate([[0], np.cumsum(np.abs(np.diff(np.floor(way))))])


def reel_unit(case_of, node="", misread=0.0):
    """The fitted problem of a reel unit whose motor at `node` sticks and cogs, or whose encoder misreads by so many
    counts that come and go."""
    case, n = read_case(case_of("ivu"), "."), 8000
    t = 2e-3 * np.arange(n)
    ref, zero = 12 * (1 - np.cos(2 * np.pi * 0.13 * t)) + 1.5 * np.sin(2 * np.pi * 0.9 * t), np.zeros(n)
    empty = Record("ivu", case, t, 2e-3, ref, zero, np.zeros((n, 2)), dict.fromkeys(REELS, zero), {})
    model = owner_model(case)
    if node:
        model = model.add(
            TERMS["friction.stribeck"].settings(node=node, F_s=5e-3, v_s=0.5),
            TERMS["ripple.cogging"].settings(node=node, per_turn=7.0, A=2e-3, phi=0.3),
        )
    out, volts, _ = Simulator(empty).everything(model, CLOSED, directed=True)
    walk = np.cumsum(np.random.default_rng(3).standard_normal(n))
    walk *= misread / max(float(np.std(walk)), 1e-9)
    y = {REELS[0]: np.floor(out[:, 0] + walk), **{name: counter(out[:, c]) for c, name in enumerate(REELS) if c}}
    problem = Problem(Simulator(empty._replace(u=volts, y=y)))
    base = base_fit(problem.sim, problem)
    problem = problem.seen_by(base.model)
    return problem, base_fit(problem.sim, problem, base.x).model


@pytest.mark.parametrize("node", ["motor1", "motor2"])
def test_the_reels_tell_which_motor(case_of, node):
    problem, model = reel_unit(case_of, node)
    assert len(problem.edges) == 2
    assert stands(problem, model, "", 0.0) == node
    other = "motor2" if node == "motor1" else "motor1"
    assert stands(problem, model, other.replace("motor", "drive"), 0.9) == node  # a guess that the reels know better
    assert stands(problem, model, node.replace("motor", "drive"), 0.9) == node.replace("motor", "drive")


def test_what_moves_together_is_told_where_most_is_amiss(case_of):
    problem, model = reel_unit(case_of, "motor1")
    assert stands(problem, model, "reel1", 0.9) == "motor1"
    assert stands(problem, model, "tape1", 0.9) == "tape1"


def test_a_reading_that_wanders_is_no_force(case_of):
    problem, model = reel_unit(case_of, misread=60.0)
    assert stands(problem, model, "motor1", 0.3) == "encoder"


@pytest.mark.parametrize(("misread", "node"), [(0.0, "carriage"), (400.0, "encoder")])
def test_the_scale_tells_of_an_encoder_that_misreads(case_of, misread, node):
    case, n = read_case(case_of("ldu"), "."), 6000
    t, zero = 1e-3 * np.arange(n), np.zeros(n)
    u = 1.2 * np.sin(2 * np.pi * 3.0 * t) + 0.8 * np.sin(2 * np.pi * 11.0 * t)
    names = ("encoder_counts", "scale_counts")
    empty = Record("ldu", case, t, 1e-3, zero, zero, u[:, None], dict.fromkeys(names, zero), {})
    model = owner_model(case)
    spot = TERMS["load.bump"].settings(node="carriage", F=2.0, at=1e-4, width=5e-4, form="push")
    out = Simulator(empty).run(model.add(spot), OPEN)
    out[:, 0] += misread * np.sin(2 * np.pi * 0.7 * t)
    problem = Problem(Simulator(empty._replace(y={name: np.floor(out[:, c]) for c, name in enumerate(names)})))
    assert stands(problem, model, "", 0.0) == node
    assert stands(problem, model, "wheel", 0.9) == node


def test_of_one_body_there_is_no_choice_but_what_is_guessed(tilted):
    problem = Problem(tilted.sim)
    assert stands(problem, tilted.model, "sensor", 0.3) == "carriage"
    assert stands(problem, tilted.model, "sensor", 0.8) == "sensor"


def test_a_push_at_a_body_moves_the_main_sensor_as_the_drives_do(case_of):
    base = {"R_c": 0.01, "R1": 0.04, "R2": 0.02, "N": 20.0}
    assert [gear("ivu", base, node) for node in ("motor1", "motor2", "capstan")] == [0.25, -0.5, 1.0]
    assert [gear("ldu", base, node) for node in ("motor", "capstan")] == [20.0, 1.0]
    problem, model = reel_unit(case_of, "motor1")
    loud = [problem.residual(model, at=at).std() for at in ("", "motor1", "motor2")]
    assert max(loud) < 2.0 * min(loud)
