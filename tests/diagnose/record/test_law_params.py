"""Law params of recordings of the program: bit-exact output for recorded columns."""

from pathlib import Path

import numpy as np
import pytest

from rtctl import api
from rtctl.diagnose.record.format1 import law_agreement, load_record
from rtctl.diagnose.record.law_params import began, law_params, law_state
from rtctl.diagnose.record.law_parts import written

MOVES = {"reference": {"steps": [{"at": 0.2, "to": 0.02, "ramp": 0.2}, {"at": 1.6, "to": 0.0, "ramp": 0.2}]}}


@pytest.fixture(scope="module")
def axis(config, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("axis") / "run"
    api.record(config("axis", mode="fused", set=MOVES), 2.5, folder)
    return folder


def test_law_of_the_shipped_axis_is_recomputed_bit_for_bit(axis):
    record = load_record(axis)
    assert record.closed_loop and law_agreement(record).worst == 0.0
    assert np.ptp(record.u) > 0.5


def test_feedforward_of_the_linear_drive_is_recomputed_from_the_shaped_reference(config, tmp_path):
    slow = {"reference": {"steps": [{"at": 0.2, "to": 0.01, "ramp": 0.05}, {"at": 1.2, "to": 0.0, "ramp": 0.05}]}}
    api.record(config("ldu", mode="fused", set={**slow, "law.inertia.volts": 0.08}), 2.1, tmp_path / "run")
    record = load_record(tmp_path / "run")
    p = law_params(record)
    assert p.friction1.volts > 0.0 and p.computed_torque == 0.08
    assert law_agreement(record).worst == 0.0
    without = written(
        p._replace(computed_torque=0.0), law_state(p, record), record.ref, record.w, record.y["encoder_counts"], 1
    )
    assert np.abs(without - record.u).max() > 0.01


def test_law_state_begins_with_the_armed_rows(axis):
    record = load_record(axis)
    p = law_params(record)
    assert len(record.armed["t"]) > 0
    assert law_state(p, record)["velocity"]["primed"][0] == 1
    cold = law_state(p, record._replace(armed=None))
    assert cold["started"][0] == 0


def test_law_origin_is_the_first_count_of_the_record(axis):
    record = load_record(axis)
    record = record._replace(y={"x": record.y["x"] + 7 * record.case.sensors.x_resolution_m})
    p = law_params(record)
    moved = began(p, record)
    assert moved.origin - began(p, load_record(axis)).origin == 7
    n = len(record.ref)
    still = np.full(n, 7 * p.resolution + 0.5 * p.resolution)
    one = written(p, law_state(p, record._replace(armed=None)), record.ref, record.w, still, 1)
    two = written(
        moved._replace(origin=7.0), law_state(p, record._replace(armed=None)), record.ref, record.w,
        still - 7 * p.resolution, 1,
    )  # fmt: skip
    np.testing.assert_array_equal(one, two)
