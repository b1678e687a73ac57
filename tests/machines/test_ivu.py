"""Shipped two-reel machine in fused mode: positioning, tape tension, and other reel radii."""

import json
from functools import lru_cache
from typing import Any

import fused
import numpy as np
import pytest

from rtctl.tick import safety

F_T = 0.1  # N
COUNT = 2 * np.pi / 10_000
ENDS = ((3.7, 1.0), (6.7, 0.0), (9.7, -1.0), (12.7, 0.0))  # s, rad, of configs/references/steps.yaml
SLACK = 1e-5  # N, rounding error of a tape at rest before its first tension


def tension(rows: Any) -> np.ndarray:
    """Truth of both tapes, (n, 2) in N."""
    return np.stack([rows["truth_tension1"], rows["truth_tension2"]], axis=1)


def running(run: fused.Run) -> Any:
    return run.rows[run["state"] == safety.RUNNING]


def radii(R1: float, R2: float) -> dict[str, float]:
    """Settings of the reel radii for the laws and for the emulator."""
    return {"radius__R1": R1, "radius__R2": R2, "plant__parameters__R1": R1, "plant__parameters__R2": R2}


def check_steps(run: fused.Run, error: float) -> None:
    assert run["trip"].max() == 0
    for t, target in ENDS:
        end = run.between(t, t + 0.25)
        assert np.ptp(end["truth_capstan"]) < 2 * COUNT  # at rest
        assert np.abs(end["truth_capstan"] - target).max() <= error


@pytest.mark.parametrize("mode", ["off", "model"])
def test_error_after_a_step_of_a_radian_is_below_a_hundredth(mode):
    run = fused.shipped("ivu", "steps", 13.5, law__gain_schedule__mode=mode)
    check_steps(run, 0.010)
    factor = running(run)["gain_factor"]
    assert np.abs(factor - 1.0).max() < (1e-12 if mode == "off" else 1.5)


@pytest.mark.parametrize("mode", ["off", "model"])
@pytest.mark.parametrize("reference", ["steps", "constant_speed"])
def test_tape_is_never_slack(mode, reference):
    run = fused.shipped("ivu", reference, 13.5, law__gain_schedule__mode=mode)
    rows = running(run)
    assert len(rows) > 0.95 * len(run.rows)
    assert tension(rows).min() > 0.0


def pushed(**changes: Any) -> np.ndarray:
    """True tension of both tapes, (n, 2) in N, in unshaped steps of a radian; the linear model gives compression."""
    steps = [{"at": 0.5, "to": -1.0}]
    changes = {"law__shaper": {}, "law__inertia": {}, "safety__following_error": 0, **changes, **radii(0.025, 0.035)}
    return tension(fused.run(fused.config("ivu", reference__steps=steps, **changes), 3.0))


def test_true_tension_includes_slack():
    """A slack tape has a tension of 0 N; the linear model alone gives -0.3 N."""
    assert pushed().min() < -0.2
    slack = pushed(plant__physics=[{"term": "tape.slack", "node": "tape1"}])
    assert slack.min() > -1e-9 and (slack == 0.0).sum() > 20


def test_true_tension_includes_the_relaxing_branch():
    """Half of the stiffness in a branch with slow relaxation: the tension is that of the plain tape."""
    half = {"plant__parameters__c1": 225.0, "plant__parameters__c2": 225.0}
    branches = [{"term": "tape.viscoelastic", "node": n, "c_branch": 225.0, "tau": 1e4} for n in ("tape1", "tape2")]
    plain, split = (
        tension(fused.run(fused.config("ivu", "steps", plant__parameters__d_tape=0.0, **changes), 2.5))
        for changes in ({}, {**half, "plant__physics": branches})
    )
    np.testing.assert_allclose(split, plain, atol=0.015)  # difference by friction
    assert plain.max() > F_T


def test_tension_is_constant_at_constant_speed():
    run = fused.shipped("ivu", "constant_speed", 13.5)
    for begin, end in ((2.5, 4.8), (7.5, 9.8)):
        steady = run.between(begin, end)
        assert np.abs(np.diff(steady["ref"]) * 500).min() == pytest.approx(1.5, rel=0.05)
        assert np.abs(tension(steady) - F_T).max() < 0.2 * F_T


@pytest.mark.parametrize("mode", ["off", "model"])
@pytest.mark.parametrize(("R1", "R2"), [(0.040, 0.040), (0.020, 0.020), (0.040, 0.020), (0.020, 0.040)])
def test_loop_is_stable_with_other_reel_radii(R1, R2, mode):
    run = fused.shipped("ivu", "steps", 13.5, law__gain_schedule__mode=mode, **radii(R1, R2))
    check_steps(run, 0.015)
    assert tension(running(run)).min() > -SLACK


def test_gain_schedule_lowers_the_gain_at_the_smallest_margin():
    """40/40 has 1.2 dB with a fixed gain, 20/20 has 20.9 dB."""
    schedule = {"law__gain_schedule__mode": "model", "law__gain_schedule__floor": 0.0}
    full, empty = (
        running(fused.shipped("ivu", "steps", 13.5, **schedule, **radii(R, R)))["gain_factor"] for R in (0.04, 0.02)
    )
    assert 0.3 < full.mean() < 0.7
    assert full.mean() < empty.mean() < 1.5


@pytest.mark.parametrize(("R1", "R2"), [(0.038, 0.022), (0.020, 0.040), (0.030, 0.030), (0.024, 0.024)])
def test_radii_are_measured_at_arming_before_the_run(R1, R2):
    """Elastic tape and motors with stiction; the measured radii are compared with the truth of the emulator."""
    plant = {"plant__parameters__R1": R1, "plant__parameters__R2": R2}
    run = fused.shipped("ivu", "steps", 22.0, radius__source="measured", **plant)
    rows = running(run)
    assert run["trip"].max() == 0
    assert len(rows) and rows["t"][0] < 12.0
    assert rows["R1"][0] == pytest.approx(rows["truth_R1"][0], rel=0.05)
    assert rows["R2"][0] == pytest.approx(rows["truth_R2"][0], rel=0.05)
    assert tension(run.rows).min() > -SLACK
    assert tension(rows).min() > 0.0
    assert np.ptp(rows["target"]) > 0.9  # the table was played
    end = run.between(6.7, 6.95)
    assert np.abs(end["capstan_error"]).max() < 0.010


def test_tracked_radii_follow_the_wound_tape():
    run = fused.shipped("ivu", "constant_speed", 13.5)
    for name in ("R1", "R2"):
        np.testing.assert_allclose(run["truth_" + name], run[name], rtol=2e-3)
    assert np.ptp(run["truth_R1"]) > 1e-4


def test_radii_are_tracked_while_the_outputs_are_off(config, bench):
    """The setting is the initial radius. Rearming keeps the tracked radius unless the setting changes."""
    steps = [{"at": 0.2, "to": 3.0, "ramp": 3.0}]
    machine = bench(config("ivu", set={"reference.steps": steps}))
    first = machine.ask("arm", "play").run(2.5)
    off = machine.ask("disarm").run(0.5)
    again = machine.ask("arm").run(0.5)
    assert first["R1"][0] == 0.038 and abs(off["R1"][-1] - 0.038) > 1e-6
    np.testing.assert_allclose(again["R1"], off["R1"][-1], rtol=1e-5)
    machine.ask("disarm").run(0.1)
    machine.take_over(config("ivu", set={"radius.R1": 0.0375}))
    assert machine.ask("arm").run(0.1)["R1"][0] == pytest.approx(0.0375, rel=1e-4)


def test_encoder_reads_the_capstan():
    run = fused.shipped("ivu", "steps", 13.5)
    off = run["truth_capstan"] - run["capstan"]
    assert np.all(off > -1.01 * COUNT) and np.all(off < 2.01 * COUNT)
    np.testing.assert_allclose(run["capstan"], run["capstan_counts"] * COUNT, atol=1e-12)


def test_run_is_bit_exact_for_one_seed():
    one, two = (fused.run(fused.config("ivu", "steps"), 3.0).rows for _ in range(2))
    assert one.tobytes() == two.tobytes()


def test_frozen_encoder_and_following_error_trip():
    """A blocked machine trips before its motors overheat."""
    run = fused.run(fused.config("ivu", "steps", plant__parameters__tau_F1=1.0, plant__parameters__tau_F2=1.0), 4.0)
    assert run["state"][-1] == safety.TRIPPED
    assert run["trip"][-1] in (safety.FROZEN, safety.FOLLOWING)
    assert not run["u1"][-1] and not run["u2"][-1]


TAU = 2.4e-3  # of motor 1, Nm
NOTHING = {"F_C": 0.0, "B": 0.0, "F_s": TAU, "v_s": 0.3, "form": "gaussian"}
SIZES = [{"F_C": 0.2 * TAU}, {"B": 1e-3}, {"F_s": 1.5 * TAU}]


@lru_cache(maxsize=8)
def with_friction(**sizes: Any) -> np.ndarray:
    """Capstan counts with three friction terms at motor 1; sizes are zero except `sizes`."""
    v = {**NOTHING, **sizes}
    terms = [
        {"term": "friction.coulomb", "node": "motor1", "F_C": v["F_C"]},
        {"term": "friction.viscous", "node": "motor1", "B": v["B"]},
        {"term": "friction.stribeck", "node": "motor1", "F_s": v["F_s"], "v_s": v["v_s"], "form": v["form"]},
    ]
    config = fused.config("ivu", "steps")
    plant = type(config.plant).model_validate(
        {**json.loads(config.plant.model_dump_json(exclude_unset=True)), "physics": terms}
    )
    return fused.run(config.model_copy(update={"plant": plant}), 6.0)["capstan_counts"]


def test_physics_terms_of_size_zero_change_nothing():
    assert np.array_equal(with_friction(), fused.shipped("ivu", "steps", 13.5)["capstan_counts"][:3000])


@pytest.mark.parametrize("sizes", SIZES, ids=["coulomb", "viscous", "stribeck"])
def test_physics_term_changes_the_recording(sizes):
    assert np.abs(with_friction(**sizes) - with_friction()).max() > 1


def test_current_ripple_of_the_drivers_hardly_moves_the_tape():
    """Chopping of the drivers at 22 kHz is modelled on request and averages out."""
    plain = fused.run(fused.config("ivu", "steps"), 3.0)
    rippled = fused.run(fused.config("ivu", "steps", plant__driver__ripple=True), 3.0)
    change = np.abs(plain["truth_capstan"] - rippled["truth_capstan"]).max()
    assert 0.0 < change < 5e-3


@pytest.mark.parametrize(("R1", "R2"), [(0.020, 0.020), (0.020, 0.040), (0.040, 0.020), (0.030, 0.030), (0.022, 0.022)])
@pytest.mark.parametrize("plant_set", ["identified", "simulation"])
def test_sensors_of_the_nominal_machine_agree_at_any_radii(R1, R2, plant_set):
    """Elastic tape, wound beyond the end of the paper of either reel, where the core radius remains."""
    steps = [
        {"at": 0.2, "to": 80.0, "ramp": 4.0}, {"at": 21.0, "to": -80.0, "ramp": 4.0},
        {"at": 62.0, "to": 0.0, "ramp": 4.0}, {"at": 83.0, "to": 1.0}, {"at": 86.0, "to": -1.0},
    ]  # fmt: skip
    run = fused.run(fused.config("ivu", reference__steps=steps, plant__set=plant_set, **radii(R1, R2)), 90.0)
    assert run["trip"].max() == 0
    for name in ("R1", "R2"):
        np.testing.assert_allclose(run[name], run["truth_" + name], rtol=5e-3)
