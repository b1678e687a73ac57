"""The loop gain measured on the emulator equals the designed one; a saturated output is no measurement."""

import filters
import fused
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.config.load import set_path
from rtctl.design import check, margins, response


def shaped():
    return set_path(fused.config("ldu"), "law.position", {"kind": "sections", **filters.FIFTY_HERTZ})


def test_measured_loop_of_the_reel_unit_is_the_designed_one():
    """Motor 1 alone, as in the measurement."""
    config = fused.config("ivu", law__allocation__kind="motor1")
    got = check.measure(config, rms=1.5, f_max=80.0)
    wanted = margins.of_config(config)
    assert pytest.approx(wanted.GM, abs=0.6) == got.margins.GM
    assert pytest.approx(wanted.PM, abs=3.0) == got.margins.PM
    middle = (got.f > 3) & (got.f < 30)
    assert np.median(np.abs(got.L[middle] / response.loop(config, got.f[middle]) - 1)) < 0.05


def test_excited_lines_are_odd_and_within_the_band():
    got = check.measure(shaped(), rms=0.4, period=1.0, f_max=120.0)
    assert got.f[0] == 1.0 and got.f[-1] <= 120.0
    assert (np.diff(got.f) == 2.0).all()


def test_check_experiment_removes_dry_friction_and_keeps_the_law():
    config = shaped()
    played = check.experiment(config, 0.5)
    assert played.plant.parameters.F_c == played.law.friction.F_c == 0.0
    assert played.law.position == config.law.position
    assert played.loop.mode == "fused" and played.loop.write == config.loop.write
    assert played.excitation.f_max == 4000.0


def test_saturated_output_is_no_measurement():
    with pytest.raises(NoAnswer, match=r"limited at .* s; lower rms from 3 V"):
        check.measure(shaped(), rms=3.0, period=0.5, f_max=120.0)


def test_trip_is_no_measurement():
    config = set_path(shaped(), "safety.following_error", 1e-5)
    with pytest.raises(NoAnswer, match="tripped"):
        check.measure(config, rms=0.5, period=0.5, f_max=120.0)


def test_excitation_below_the_noise_is_no_measurement():
    """0.01 V moves the capstan by less than a count."""
    with pytest.raises(NoAnswer, match="differ from period to period: take more rms"):
        check.measure(fused.config("ivu", law__allocation__kind="motor1"), rms=0.01, f_max=80.0)
