"""Identification experiments: machine limits, and intervals required by the estimators."""

import frf_runs
import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.identify import experiment
from rtctl.identify.records import steady


@pytest.mark.parametrize("name, speed", [("ivu", 1.97), ("ldu", 5e-3)])
def test_multisine_is_played_at_constant_speed_back_and_forth(name, speed):
    record = frf_runs.shipped(name)[0]
    whole = [s for s in steady(record, 0.0) if (s.stop - s.start) * record.dt > 5 * experiment.PERIOD]
    assert len(whole) == 2
    moves = [np.diff(record["ref"][s]).mean() / record.dt for s in whole]
    assert moves == pytest.approx([speed, -speed], rel=1e-3)
    assert abs(record["ref"][whole[0]].mean() - record["ref"][0]) < 0.1 * np.ptp(record["ref"])
    assert record["w"].std() == pytest.approx(experiment.usual_of(record.config).rms, rel=0.1)
    assert not record.trip


@pytest.mark.parametrize("name", ["ivu", "ldu"])
def test_drive_and_tape_stay_within_their_limits(name):
    record = frf_runs.shipped(name)[0]
    assert max(np.abs(record[u]).max() for u in record.signals.written) < (9.0 if name == "ivu" else 3.0)
    if name == "ivu":
        assert record["truth_tension1"][500:].min() > 0.0
        assert record["truth_tension2"][500:].min() > 0.0
        assert abs(record["R1"].mean() - 0.038) < 1e-4  # back and forth about the initial radius


def test_noise_record_has_the_requested_number_of_windows():
    assert len(experiment.noise(frf_runs.config())) == 1
    runs = experiment.noise(frf_runs.config("ldu"))
    seeds = [e.config.excitation.seed for e in runs]
    assert len(runs) == 7 and len(set(seeds)) == 7  # 6.55 s of noise without repetition in each run
    assert runs[0].config.excitation.f_max == 1000.0


def test_realisations_differ_in_their_seed_only():
    one, two = experiment.multisine(frf_runs.config(), realisations=2)
    assert one.config.excitation.seed != two.config.excitation.seed
    same = two.config.excitation.model_copy(update={"seed": one.config.excitation.seed})
    assert same == one.config.excitation and one.config.law == two.config.law


def test_experiment_beyond_the_machine_limits_is_refused():
    with pytest.raises(UserError, match=r"peaks at some 8 V, the drive takes 5 V; take 1\.2 V or less"):
        experiment.multisine(frf_runs.config(), rms=2.0)
    with pytest.raises(UserError, match="the drive takes 3 V"):
        experiment.noise(frf_runs.config("ldu"), rms=1.0)
    with pytest.raises(UserError, match="no such motor"):
        experiment.multisine(frf_runs.config("ldu"), motor=2)
    with pytest.raises(UserError, match="not on axis"):
        experiment.noise(frf_runs.config("axis"))


def test_configured_gains_can_be_kept():
    kept = experiment.noise(frf_runs.config(), keep_law=True)[0].config
    assert kept.law.position == frf_runs.config().law.position
    assert kept.law.allocation.kind == "motor1"
