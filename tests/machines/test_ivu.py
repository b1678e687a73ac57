"""The shipped two-reel machine, run fused: it positions, never lets go of the tape, and copes with other reels."""

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
SLACK = 1e-5  # N, rounding of a tape that lies still before it is pulled for the first time


def tension(rows: Any) -> np.ndarray:
    """Truth of both tapes, (n, 2) in N."""
    return np.stack([rows["truth_tension1"], rows["truth_tension2"]], axis=1)


def running(run: fused.Run) -> Any:
    return run.rows[run["state"] == safety.RUNNING]


def radii(R1: float, R2: float) -> dict[str, float]:
    """The same reels for the laws and for the emulator."""
    return {"radius__R1": R1, "radius__R2": R2, "plant__parameters__R1": R1, "plant__parameters__R2": R2}


def check_steps(run: fused.Run, error: float) -> None:
    assert run["trip"].max() == 0
    for t, target in ENDS:
        end = run.between(t, t + 0.25)
        assert np.ptp(end["truth_capstan"]) < 2 * COUNT  # at rest
        assert np.abs(end["truth_capstan"] - target).max() <= error


@pytest.mark.parametrize("mode", ["off", "model"])
def test_steps_of_a_radian_end_within_a_hundredth(mode):
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
    """Truth of both tapes (n, 2) in N in steps of a radian that are not shaped: the model's tape pushes in them."""
    steps = [{"at": 0.5, "to": -1.0}]
    changes = {"law__shaper": {}, "law__inertia": {}, "safety__following_error": 0, **changes, **radii(0.025, 0.035)}
    return tension(fused.run(fused.config("ivu", reference__steps=steps, **changes), 3.0))


def test_truth_of_the_tension_has_the_slack_in_it():
    """A tape that cannot push has a tension of 0 N where the linear model alone has -0.3 N."""
    assert pushed().min() < -0.2
    slack = pushed(plant__physics=[{"term": "tape.slack", "node": "tape1"}])
    assert slack.min() > -1e-9 and (slack == 0.0).sum() > 20


def test_truth_of_the_tension_has_a_relaxing_branch_in_it():
    """Half of the stiffness in a branch that does not relax meanwhile: the tension is that of the plain tape."""
    half = {"plant__parameters__c1": 225.0, "plant__parameters__c2": 225.0}
    branches = [{"term": "tape.viscoelastic", "node": n, "c_branch": 225.0, "tau": 1e4} for n in ("tape1", "tape2")]
    plain, split = (
        tension(fused.run(fused.config("ivu", "steps", plant__parameters__d_tape=0.0, **changes), 2.5))
        for changes in ({}, {**half, "plant__physics": branches})
    )
    np.testing.assert_allclose(split, plain, atol=0.015)  # friction holds them a little apart
    assert plain.max() > F_T


def test_tension_stays_at_constant_speed():
    run = fused.shipped("ivu", "constant_speed", 13.5)
    for begin, end in ((2.5, 4.8), (7.5, 9.8)):
        steady = run.between(begin, end)
        assert np.abs(np.diff(steady["ref"]) * 500).min() == pytest.approx(1.5, rel=0.05)
        assert np.abs(tension(steady) - F_T).max() < 0.2 * F_T


@pytest.mark.parametrize("mode", ["off", "model"])
@pytest.mark.parametrize(("R1", "R2"), [(0.040, 0.040), (0.020, 0.020), (0.040, 0.020), (0.020, 0.040)])
def test_other_reels_are_stable_too(R1, R2, mode):
    run = fused.shipped("ivu", "steps", 13.5, law__gain_schedule__mode=mode, **radii(R1, R2))
    check_steps(run, 0.015)
    assert tension(running(run)).min() > -SLACK


def test_schedule_lowers_the_gain_where_the_margin_is_least():
    """40/40 has 1.2 dB with a fixed gain, 20/20 has 20.9 dB."""
    schedule = {"law__gain_schedule__mode": "model", "law__gain_schedule__floor": 0.0}
    full, empty = (
        running(fused.shipped("ivu", "steps", 13.5, **schedule, **radii(R, R)))["gain_factor"] for R in (0.04, 0.02)
    )
    assert 0.3 < full.mean() < 0.7
    assert full.mean() < empty.mean() < 1.5


@pytest.mark.parametrize(("R1", "R2"), [(0.038, 0.022), (0.020, 0.040), (0.030, 0.030), (0.024, 0.024)])
def test_radii_are_measured_at_arming_and_then_it_runs(R1, R2):
    """On a tape that stretches, with motors that stick; the emulator knows the truth."""
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


def test_radii_follow_the_tape():
    run = fused.shipped("ivu", "constant_speed", 13.5)
    for name in ("R1", "R2"):
        np.testing.assert_allclose(run["truth_" + name], run[name], rtol=2e-3)
    assert np.ptp(run["truth_R1"]) > 1e-4


def test_radii_are_followed_while_the_outputs_are_off(config, bench):
    """A setting is where they start. What has been wound since is not forgotten by arming again, unless it changes."""
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


def test_the_same_seed_gives_the_same_bits():
    one, two = (fused.run(fused.config("ivu", "steps"), 3.0).rows for _ in range(2))
    assert one.tobytes() == two.tobytes()


def test_frozen_encoder_and_following_error_trip():
    """A machine that cannot move trips instead of burning its motors."""
    run = fused.run(fused.config("ivu", "steps", plant__parameters__tau_F1=1.0, plant__parameters__tau_F2=1.0), 4.0)
    assert run["state"][-1] == safety.TRIPPED
    assert run["trip"][-1] in (safety.FROZEN, safety.FOLLOWING)
    assert not run["u1"][-1] and not run["u2"][-1]


TAU = 2.4e-3  # of motor 1, Nm
NOTHING = {"F_C": 0.0, "B": 0.0, "F_s": TAU, "v_s": 0.3, "form": "gaussian"}
SIZES = [{"F_C": 0.2 * TAU}, {"B": 1e-3}, {"F_s": 1.5 * TAU}]


@lru_cache(maxsize=8)
def with_friction(**sizes: Any) -> np.ndarray:
    """Trace of the capstan with all three terms at motor 1, of nothing but for `sizes`."""
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


def test_terms_of_size_nothing_change_nothing():
    assert np.array_equal(with_friction(), fused.shipped("ivu", "steps", 13.5)["capstan_counts"][:3000])


@pytest.mark.parametrize("sizes", SIZES, ids=["coulomb", "viscous", "stribeck"])
def test_a_term_shows_in_the_recording(sizes):
    assert np.abs(with_friction(**sizes) - with_friction()).max() > 1


def test_the_ripple_of_the_drivers_hardly_moves_the_tape():
    """22 kHz of chopping is there when asked for, and averages out."""
    plain = fused.run(fused.config("ivu", "steps"), 3.0)
    rippled = fused.run(fused.config("ivu", "steps", plant__driver__ripple=True), 3.0)
    change = np.abs(plain["truth_capstan"] - rippled["truth_capstan"]).max()
    assert 0.0 < change < 5e-3


@pytest.mark.parametrize(("R1", "R2"), [(0.020, 0.020), (0.020, 0.040), (0.040, 0.020), (0.030, 0.030), (0.022, 0.022)])
@pytest.mark.parametrize("plant_set", ["identified", "simulation"])
def test_sensors_of_a_healthy_machine_agree_at_any_radii(R1, R2, plant_set):
    """Wound past the end of the paper of either reel, where its core's radius stays, and with a tape that stretches."""
    steps = [
        {"at": 0.2, "to": 80.0, "ramp": 4.0}, {"at": 21.0, "to": -80.0, "ramp": 4.0},
        {"at": 62.0, "to": 0.0, "ramp": 4.0}, {"at": 83.0, "to": 1.0}, {"at": 86.0, "to": -1.0},
    ]  # fmt: skip
    run = fused.run(fused.config("ivu", reference__steps=steps, plant__set=plant_set, **radii(R1, R2)), 90.0)
    assert run["trip"].max() == 0
    for name in ("R1", "R2"):
        np.testing.assert_allclose(run[name], run["truth_" + name], rtol=5e-3)
