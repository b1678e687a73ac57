"""Solver: energy, step halving, dry friction at rest, law recomputed from the recording."""

import numpy as np
import pytest

from rtctl.proof import law, machine, plants, solver
from rtctl.proof.generate import floors, simulate
from rtctl.proof.machine import NQ, NU, NY
from rtctl.proof.setup import draws


def free_motion(m, start, seconds=0.5):
    """Final state of the undriven machine."""
    n = int(seconds / float(m["Ts"]))
    y, u = np.zeros((n, NY)), np.zeros((n, NU))
    silent = machine.law_record(kind=law.SECTIONS, Ts=float(m["Ts"]), limit=1.0, top=1.0)
    state = np.array(start, float)
    rows = solver.run(
        m[()], silent[()], state, np.zeros(n), np.zeros(n), np.arange(n + 1) * float(m["Ts"]), np.zeros((n, NQ)),
        np.zeros(n), np.zeros((n, NY)), np.zeros((n, NY)), y, u,
    )  # fmt: skip
    assert rows == n
    return state


def chain(k=0.0):
    m = machine.blank()
    m["nq"], m["nu"], m["ny"], m["Ts"], m["sub"] = 3, 1, 1, 1e-3, 20
    m["q_J"][:3] = [1e-3, 2e-4, 5e-4]
    machine.spring(m, 0, 1, 1.0, -2.0, 10.0, k)
    machine.spring(m, 1, 2, 1.0, -1.0, 30.0, k)
    return m


def energy(m, x):
    total = 0.5 * float(np.sum(m["q_J"][:3] * x[NQ : NQ + 3] ** 2))
    for s in range(int(m["ns"])):
        i, j = int(m["s_i"][s]), int(m["s_j"][s])
        total += 0.5 * float(m["s_c"][s]) * float(m["s_a_i"][s] * x[i] + m["s_a_j"][s] * x[j]) ** 2
    return total


def test_energy_is_conserved_without_damping_and_decreases_with_damping():
    start = np.zeros(2 * NQ)
    start[:3], start[NQ : NQ + 3] = [0.1, -0.05, 0.2], [1.0, 0.0, -3.0]
    m = chain()
    assert energy(m, free_motion(m, start)) == pytest.approx(energy(m, start), rel=1e-6)
    damped = chain(0.01)
    assert energy(damped, free_motion(damped, start)) < 0.5 * energy(damped, start)


def test_pendulum_conserves_energy():
    m = machine.blank()
    m["nq"], m["nu"], m["ny"], m["Ts"], m["sub"] = 1, 1, 1, 1e-3, 20
    m["q_J"][0] = 1e-3
    m["wave_a"][0, 0], m["wave_n"][0, 0] = 0.05, 1.0
    x = free_motion(m, [1.0] + [0.0] * (2 * NQ - 1), 2.0)
    total = 0.5 * 1e-3 * x[NQ] ** 2 - 0.05 * np.cos(x[0])
    assert total == pytest.approx(-0.05 * np.cos(1.0), rel=1e-6)


@pytest.mark.parametrize("friction", [machine.STOP, machine.SMOOTH])
def test_stopping_distance_under_dry_friction_follows_from_kinetic_energy(friction):
    m = machine.blank()
    m["nq"], m["nu"], m["ny"], m["Ts"], m["sub"] = 1, 1, 1, 1e-3, 50
    m["q_J"][0] = 1e-3
    machine.dry(m, 0, 2e-3, 2e-5, friction, 2e-4)
    start = np.zeros(2 * NQ)
    start[NQ] = 1.0
    x = free_motion(m, start, 2.0)
    assert x[0] == pytest.approx(0.5 * 1e-3 / 2e-3, rel=1e-2)
    assert abs(x[NQ]) < 1e-5


def test_stop_friction_holds_a_load_below_its_level_without_creep():
    m = machine.blank()
    m["nq"], m["nu"], m["ny"], m["Ts"], m["sub"] = 1, 1, 1, 1e-3, 50
    m["q_J"][0] = 1e-3
    machine.dry(m, 0, 2e-3, 2e-5, machine.STOP, 1e-3)
    m["wave_a"][0, 0], m["wave_ph"][0, 0], m["wave_n"][0, 0] = 0.9e-3, -np.pi / 2, 1e-9  # a constant force
    early, late = free_motion(m, np.zeros(2 * NQ), 1.0)[0], free_motion(m, np.zeros(2 * NQ), 4.0)[0]
    assert late == pytest.approx(0.45 * 2e-5, rel=0.01)
    assert late == pytest.approx(early, rel=1e-3)


@pytest.mark.parametrize(("plant", "node", "sensors"), [("ivu", 4, [0]), ("ldu", 2, [0, 1]), ("axis", 0, [0])])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_nominal_machine_stays_at_rest_under_a_force_below_its_dry_friction(plant, node, sensors, seed):
    """The displacement is below 0.05 counts; larger presliding is an effect of the table."""
    m = plants.BUILD[plant](np.random.default_rng(seed), "rich", False, False).m
    others = {"ivu": [0, 1, 2, 3], "ldu": [], "axis": []}[plant]  # friction elsewhere would hold the node
    m["q_F_C"][others] = 0.0
    level = float(m["q_F_C"][node])
    m["wave_a"][node, 0], m["wave_ph"][node, 0], m["wave_n"][node, 0] = 0.9 * level, -np.pi / 2, 1e-9
    gave = free_motion(m, np.zeros(2 * NQ), 0.1)[node]
    for s in sensors:
        assert 0.0 < abs(gave) * float(m["y_gain"][s]) < 0.05


@pytest.mark.parametrize("plant", ["ivu", "ldu", "axis"])
def test_halving_the_step_changes_less_than_the_noise_floor(plant):
    s = plants.BUILD[plant](np.random.default_rng(5), "rich", False, False)
    keep = s.n // 4
    s.ref, s.w = s.ref[:keep], s.w[:keep]
    coarse = simulate(s, [1])
    floor = floors(s, coarse, simulate(s, [2]))
    s.m["sub"] *= 2
    fine = simulate(s, [1])
    main = s.sensors[0]
    assert np.sqrt(np.mean((coarse[main] - fine[main]) ** 2)) < floor[main]


@pytest.mark.parametrize("plant", ["ivu", "ldu", "axis"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_law_of_the_case_reproduces_the_recorded_voltages(plant, seed):
    s = plants.BUILD[plant](np.random.default_rng(seed), "rich", False, False)
    s.ref, s.w = s.ref[:3000], s.w[:3000]
    run = simulate(s, [seed])
    u = law.recompute(s.case, run)
    for k, name in enumerate(c for c in ("u", "u1", "u2") if c in run):
        assert np.array_equal(u[:, k], run[name])
    assert len({tuple(row) for row in u}) > 10


def test_delay_shifts_the_current_and_not_the_law():
    s = plants.BUILD["axis"](np.random.default_rng(3), "rich", False, False)
    s.ref, s.w = s.ref[:2000], s.w[:2000]
    before = simulate(s, [1])
    s.m["delay"] += 0.5
    after = simulate(s, [1])
    assert np.array_equal(law.recompute(s.case, after)[:, 0], after["u"])
    assert not np.array_equal(before["x"], after["x"])


def test_noise_streams_do_not_depend_on_other_hidden_effects():
    s = plants.BUILD["ivu"](np.random.default_rng(3), "rich", False, False)
    before = draws(s, [4])
    s.hidden.random_sd[0], s.hidden.walk[0], s.hidden.lost_rate[0], s.hidden.lost_counts[0] = 1.0, 1.0, 1.0, 5.0
    after = draws(s, [4])
    assert np.array_equal(before["push"][:, 1:], after["push"][:, 1:])
    assert np.array_equal(before["extra"][:, 1:], after["extra"][:, 1:])
    assert np.array_equal(before["ticks"], after["ticks"])
    assert after["lost"][:, 0].any()
    assert not before["lost"].any()
