"""Sensitivity from noise on the emulated machines against their models; uninformative data."""

from dataclasses import replace

import frf_runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path
from rtctl.design import response
from rtctl.identify import sensitivity
from rtctl.identify.frf import CIRCLE_95


@pytest.fixture(scope="module")
def ivu() -> sensitivity.Sensitivity:
    return sensitivity.identify(frf_runs.noise())


def test_measured_sensitivity_agrees_with_the_model(ivu):
    config = frf_runs.noise()[0].config
    S = 1 / (1 + response.loop(config, ivu.f))
    inside = np.abs(ivu.S - S) < CIRCLE_95 * ivu.S_sd
    assert ivu.averages >= 50
    assert inside.mean() == pytest.approx(0.95, abs=0.025)


def test_sensitivity_is_one_above_the_bandwidth_of_the_thesis_loop(ivu):
    """8.1: from 1 Hz S is about 0 dB."""
    assert np.abs(20 * np.log10(np.abs(ivu.S[ivu.f > 3.5]))).max() < 1.0
    assert np.abs(ivu.S[0]) < 0.5
    assert ivu.coherence[ivu.f > 3.5].min() > 0.99


def test_process_is_identified_to_60_hz_and_agrees_with_the_model(ivu):
    """8.1: very noisy from 60 Hz."""
    frf, config = ivu.frf, frf_runs.noise()[0].config
    assert 45.0 < frf.f[-1] < 75.0
    parts = response.take(config)
    H = response.plant_response(parts.model, frf.f) * response.hold(parts, frf.f)
    assert np.mean(np.abs(frf.H - H) < CIRCLE_95 * frf.sd) > 0.9
    assert abs(frf.without_drive(config).at(5.0) / (H / 0.2)[np.argmin(np.abs(frf.f - 5.0))]) == pytest.approx(
        1, rel=0.1
    )


def test_sensitivity_of_the_linear_drive():
    short = frf_runs.noise("ldu", averages=16, windows=8)
    result = sensitivity.identify(short)
    S = 1 / (1 + response.loop(short[0].config, result.f))
    assert len(short) == 2
    assert np.mean(np.abs(result.S - S) < CIRCLE_95 * result.S_sd) > 0.93
    assert result.frf.f[-1] > 100.0


def test_band_without_significant_lines_is_named(ivu):
    assert sensitivity.identify(frf_runs.noise(), (2.0, 40.0)).frf.f[-1] == pytest.approx(40.0, abs=0.3)
    with pytest.raises(NoAnswer, match=r"too inaccurate from \d+\.?\d* to 1[45]\d Hz: coherence"):
        sensitivity.identify(frf_runs.noise(), (2.0, 150.0))
    with pytest.raises(NoAnswer, match="nothing was excited from 300 to 400 Hz"):
        sensitivity.identify(frf_runs.noise(), (300.0, 400.0))


def shorter(seconds: float):
    record = frf_runs.noise()[0]
    n = round(seconds / record.dt)
    return replace(record, columns={name: np.asarray(c)[:n] for name, c in record.columns.items()})


def test_too_short_record_error_names_the_needed_length():
    with pytest.raises(NoAnswer, match=r"too short, .* 8 are the least and 50 are usual, 104 s"):
        sensitivity.identify(shorter(25.0))


def test_deviation_grows_with_less_data(ivu):
    less = sensitivity.identify(shorter(60.0))
    band = (ivu.f > 5) & (ivu.f < 40)
    assert np.median(less.S_sd[band]) > 1.3 * np.median(ivu.S_sd[band])


def test_weak_excitation_has_no_answer():
    weak = frf_runs.noise(rms=2e-3, averages=8)
    with pytest.raises(NoAnswer, match="coherence is too low from"):
        sensitivity.identify(weak)


def test_inconsistent_records_are_refused():
    record = frf_runs.noise()[0]
    other = replace(record, config=set_path(record.config, "law.position.gain", 6.0))
    with pytest.raises(UserError, match="must be those of"):
        sensitivity.identify([record, other])
    with pytest.raises(UserError, match=r"excitation\.kind is multisine"):
        sensitivity.identify(list(frf_runs.shipped()))
    with pytest.raises(NoAnswer, match="nothing was excited"):
        sensitivity.identify(replace(record, columns={**record.columns, "w": 0 * record["w"]}))
