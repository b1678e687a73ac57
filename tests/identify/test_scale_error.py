"""Encoder against scale: printer of chapter 11 with 0.36 mm over 600 mm and 1.8 um."""

import bench_runs as runs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import bench
from rtctl.identify import scale_error as se


def test_scale_error_trend_of_the_printer():
    (one,) = se.passes(runs.played(se.scale_config, "ldu_printer", 0.602, 0.05), 0.6)
    trend = se.scale_error(one.x, one.e, 3e-3)
    assert one.speed == pytest.approx(0.05, rel=1e-3)
    assert trend.travel == pytest.approx(0.6, rel=1e-3)
    assert trend.rise == pytest.approx(0.36e-3, rel=0.03)
    assert trend.radius_error == pytest.approx(1.8e-6, rel=0.03)
    assert abs(trend.radius_error - 1.8e-6) < trend.radius_half
    # 8 and 6 um of the strip, 5.8 um of capstan and encoder
    assert trend.periodic == pytest.approx(np.sqrt((8**2 + 6**2 + 5.8**2) / 2) * 1e-6, rel=0.1)


def test_correct_nominal_radius_has_no_trend():
    record = runs.played(believed, "ldu_printer")
    (one,) = se.passes(record, 0.6)
    trend = se.scale_error(one.x, one.e, record.config.sensors.R_c)
    assert abs(trend.radius_error) < trend.radius_half


def believed(config):
    return bench.changed(se.scale_config(config, 0.602, 0.05), {"sensors.R_c": 3.0018e-3})


@settings(deadline=None, max_examples=50)
@given(slope=st.floats(-1e-3, 1e-3), amplitude=st.floats(0, 1e-5), phase=st.floats(0, 6.28))
def test_confidence_interval_covers_the_trend(slope, amplitude, phase):
    x = np.linspace(0, 0.6, 3000)
    trend = se.scale_error(x, slope * x + amplitude * np.sin(2 * np.pi * x / 0.01885 + phase), 3e-3)
    assert abs(trend.slope - slope) <= trend.half + 1e-9


def test_short_records_are_refused():
    with pytest.raises(NoAnswer, match="no pass of 600 mm at constant speed; the longest has 1"):
        se.passes(runs.played(se.scale_config, "ldu_printer", 0.15, 0.05), 0.6)
    with pytest.raises(NoAnswer, match="too short for a trend"):
        se.scale_error(np.linspace(0, 0.05, 100), np.zeros(100), 3e-3)
    with pytest.raises(UserError, match="for ldu, not for ivu"):
        se.scale_config(runs.config("ivu"))
