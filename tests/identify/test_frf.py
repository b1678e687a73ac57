"""Measured response with deviation: bands, interpolation, division by the drive, and insignificant lines."""

import frf_runs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.identify import frf
from rtctl.identify.records import take
from rtctl.loop import fused

F = np.geomspace(0.5, 100.0, 60)


def mass(sd: float = 0.01) -> frf.Frf:
    H = 5.1 / (2j * np.pi * F) ** 2
    return frf.Frf(F, H, sd * np.abs(H), "ivu", 1, 0.038, 0.022, 0.002, 1.0, False)


def test_response_of_a_mass_is_interpolated_without_error():
    assert mass().at(1.0) == pytest.approx(5.1 / (2j * np.pi) ** 2, rel=1e-12)
    with pytest.raises(UserError, match="outside of the response"):
        mass().at(200.0)


def test_confidence_band_covers_95_percent():
    rng = np.random.default_rng(1)
    one = frf.Frf(np.ones(1), np.ones(1) + 0j, np.full(1, 0.1), "ivu", 1, 0.0, 0.0, 0.002, 1.0, False)
    low, high = one.band()
    drawn = 1 + 0.1 * (rng.standard_normal(50_000) + 1j * rng.standard_normal(50_000)) / np.sqrt(2)
    assert np.mean(np.abs(drawn - 1) < high[0] - 1) == pytest.approx(0.95, abs=0.005)
    assert low[0] == pytest.approx(2 - high[0])


def test_drive_is_divided_out_once():
    per_ampere = mass().without_drive(frf_runs.config())
    assert abs(per_ampere.at(1.0)) * (2 * np.pi) ** 2 == pytest.approx(5.1 / 0.2, rel=1e-3)
    assert per_ampere.relative == pytest.approx(mass().relative)
    with pytest.raises(UserError, match="already"):
        per_ampere.without_drive(frf_runs.config())


def test_drive_response_is_that_of_the_machine():
    assert abs(frf.drive(frf_runs.config("ldu"), np.array([1.0]))[0]) == pytest.approx(0.1, rel=1e-3)
    assert abs(frf.drive(frf_runs.config("ldu"), np.array([2000.0]))[0]) == pytest.approx(0.1 / np.sqrt(2), rel=1e-3)
    with pytest.raises(UserError, match="no drive"):
        frf.drive(frf_runs.config("axis"), F)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000))
def test_lines_of_noise_alone_are_insignificant(seed):
    rng = np.random.default_rng(seed)
    relative = 1 / np.abs(rng.standard_normal(300) + 1j * rng.standard_normal(300)) * np.sqrt(2)
    assert frf.carried(relative).sum() <= 3
    assert frf.carried(np.full(300, 0.1)).all()


def test_both_motors_at_once_are_not_one_response():
    steps = [{"at": 0.2, "to": 1.0, "ramp": 1.0}, {"at": 1.5, "to": 0.0, "ramp": 1.0}]
    record = take(fused.run(frf_runs.config(reference={"steps": steps}), 4.0))
    with pytest.raises(UserError, match=r"law\.allocation\.kind is pull"):
        frf.motor_of(record)
