import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import gain_schedule, process_gain

radius = st.floats(0.02, 0.04)
TABLE = {"R_drive": [0.02, 0.03, 0.04], "R_other": [0.02, 0.04], "factor": [[1.0, 2.0], [3.0, 4.0], [0.4, 0.2]]}


def built(**choices):
    return gain_schedule.build(gain_schedule.GainScheduleSettings(**choices), 0.002)


OFF, MODEL, MARGIN = built(), built(mode="model", floor=0.0), built(mode="margin", table=TABLE)


def factor(p, R1, R2, direction=1.0):
    return gain_schedule.step(p, np.zeros(1, gain_schedule.GAIN_SCHEDULE_STATE)[0], R1, R2, direction)


def test_gain_factor_is_one_when_off():
    assert factor(OFF, 0.04, 0.02) == 1.0


@settings(deadline=None)
@given(radius, radius)
def test_model_schedule_keeps_the_loop_gain_at_its_design_value(R1, R2):
    design = process_gain.step(MODEL.process, 0.038, 0.022)
    assert factor(MODEL, R1, R2, 1.0) * process_gain.step(MODEL.process, R1, R2) == pytest.approx(design)
    assert factor(MODEL, R1, R2, -1.0) * process_gain.step(MODEL.process, R2, R1) == pytest.approx(design)


@settings(deadline=None)
@given(radius, radius)
def test_model_schedule_with_default_floor_never_lowers_the_gain(R1, R2):
    p = built(mode="model")
    assert factor(p, R1, R2) == max(factor(MODEL, R1, R2), 1.0)


@settings(deadline=None)
@given(radius, radius)
def test_factor_for_both_drives_is_the_mean_of_both_directions(R1, R2):
    for p in (MODEL, MARGIN):
        mean = (factor(p, R1, R2, 1.0) + factor(p, R1, R2, -1.0)) / 2
        assert factor(p, R1, R2, 0.0) == pytest.approx(mean)


@pytest.mark.parametrize(
    ("R1", "R2", "wanted"),
    [
        (0.02, 0.02, 1.0),
        (0.04, 0.04, 0.2),
        (0.03, 0.03, 3.5),
        (0.025, 0.03, 2.5),
        (0.035, 0.02, 1.7),
        (0.1, 0.0, 0.4),
    ],
)
def test_margin_schedule_interpolates_and_stays_within_the_table(R1, R2, wanted, record):
    assert factor(MARGIN, R1, R2) == pytest.approx(wanted)
    assert factor(record(MARGIN), R2, R1, -1.0) == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (None, "takes a table"),
        ({**TABLE, "factor": [[1.0, 2.0]]}, "3 rows of 2 numbers"),
        ({**TABLE, "R_other": [0.04, 0.02]}, "R_other must rise"),
        ({**TABLE, "factor": [[1.0, 2.0], [3.0, -4.0], [0.4, 0.2]]}, "positive"),
    ],
)
def test_invalid_schedule_table_is_refused(table, words):
    with pytest.raises(ValueError, match=words):
        built(mode="margin", table=table)
