"""Compiled law: its parts, their order, and agreement with recorded voltages."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.case.format1 import read_case
from rtctl.diagnose.record import law, law_params, law_parts
from rtctl.diagnose.record.format1 import load_record
from rtctl.drivers.at_mio_16de import AnalogOutputParams
from rtctl.laws import allocation
from rtctl.laws.allocation import AllocationSettings
from rtctl.laws.friction_feedforward import FrictionFeedforwardParams
from rtctl.laws.limit import LimitParams
from rtctl.laws.pd import PdParams
from rtctl.laws.pi_velocity import PiVelocityParams

BUNDLES = ("case-0001", "case-0002", "case-0003", "case-0004", "case-0005", "case-0006", "case-0007", "case-0018")


def law_output(p: law.LawParams, ref: Any, w: Any, reading: Any, drives: int) -> np.ndarray:
    """Output (n, drives) of the law in V for the given rows."""
    return law_parts.written(p, np.zeros(1, law.LAW_STATE), ref, w, reading, drives)


def params(**values: Any) -> law.LawParams:
    """Law of an axis at 1 kHz; parts not given are inactive."""
    case = read_case({"plant": "axis", "controller": {"kind": "none"}}, ".")
    blank = law_params.plain(case, 1e-3)._replace(limit=LimitParams(-10.0, 10.0, math.inf))
    return blank._replace(**values)


def output(lsb: float, top: float) -> AnalogOutputParams:
    return AnalogOutputParams(lsb, -round(top / lsb) - 1, round(top / lsb), 0, 0.0, 0.0)


def tape(**values: Any) -> law.LawParams:
    return params(kind=law.PD, tape=law.CONSTANT, pd=PdParams(3.0, 0.0, 1.0, 1e-3), **values)


@pytest.mark.parametrize("name", BUNDLES)
def test_law_reproduces_recorded_voltages_bit_for_bit(practice, name):
    record = load_record(practice / name)
    reading = next(iter(record.y.values()))
    volts = law_output(law_params.law_params(record), record.ref, record.w, reading, record.u.shape[1])
    np.testing.assert_array_equal(volts, record.u)


def test_law_of_the_axis_matches_a_direct_calculation(plain):
    record, c = plain.record, plain.record.case.controller
    volts = law_output(law_params.law_params(record), record.ref, record.w, record.y["x"], 1)
    mean = 0.5 * (record.y["x"] + np.concatenate((record.y["x"][:1], record.y["x"][:-1])))
    v = np.diff(mean, prepend=mean[0]) / record.dt
    wanted = np.clip(c.kp * c.kv * (record.ref - record.y["x"]) - c.kv * v + record.w, -10.0, 10.0)
    np.testing.assert_allclose(volts[:, 0], wanted, rtol=0, atol=1e-9)
    assert np.ptp(wanted) > 1.0


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=12), st.floats(0.5, 10.0), st.integers(2, 12))
def test_voltages_are_limited_and_on_converter_steps(ref, limit, bits):
    lsb = 20.0 / 2**bits
    p = params(
        kind=law.PI_VELOCITY, two_tap=1, pi_velocity=PiVelocityParams(160.0 * 243.0, 0.0, 243.0, 0.0),
        limit=LimitParams(-limit, limit, math.inf), rounds=law.HALVES_UP, output=output(lsb, 10.0 - lsb),
    )  # fmt: skip
    volts = law_output(p, ref, np.zeros(len(ref)), np.zeros(len(ref)), 1)
    steps = volts / lsb
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.abs(volts).max() <= limit + 0.5 * lsb + 1e-12
    assert volts.max() <= 10.0 - lsb + 1e-12


def test_half_converter_steps_are_rounded_up_for_both_signs():
    p = params(kind=law.SECTIONS, n_sections=1, rounds=law.HALVES_UP, output=output(1.0, 9.0))
    p.sections[0] = (1.0, 0.0, 0.0, 0.0, 0.0)
    volts = law_output(p, [0.5, -0.5, 1.5, -1.5, 9.9], np.zeros(5), np.zeros(5), 1)
    np.testing.assert_array_equal(volts[:, 0], [1.0, 0.0, 2.0, -1.0, 9.0])
    volts = law_output(p._replace(rounds=law.BOARD), [0.5, -0.5, 1.5, -1.5, 9.9], np.zeros(5), np.zeros(5), 1)
    np.testing.assert_array_equal(volts[:, 0], [0.0, 0.0, 2.0, -2.0, 9.0])  # the board rounds half to even


@pytest.mark.parametrize(("name", "wanted"), [
    ("pull", (1.0 + 3.0, 2.0)), ("differential", (1.0 + 1.5, 2.0 - 1.5)), ("motor1", (1.0 + 3.0, 2.0)),
    ("motor2", (1.0, 2.0 - 3.0)),
])  # fmt: skip
def test_each_allocation_distributes_a_forward_command(name, wanted):
    p = tape(pull1=1.0, pull2=2.0, allocation=allocation.build(AllocationSettings(kind=name), 1e-3))
    np.testing.assert_allclose(law_output(p, [1.0], [0.0], [0.0], 2)[0], wanted, rtol=1e-15)


def test_pull_allocation_gives_a_backward_command_to_the_other_motor():
    p = tape(pull1=1.0, pull2=2.0)
    np.testing.assert_allclose(law_output(p, [-1.0], [0.0], [0.0], 2)[0], [1.0, 5.0])


def test_friction_compensation_follows_the_sign_of_the_reference_step():
    p = tape(friction1=FrictionFeedforwardParams(0.25, held=0))
    p = p._replace(
        pd=PdParams(0.0, 0.0, 1.0, 1e-3), allocation=allocation.build(AllocationSettings(kind="motor1"), 1e-3)
    )
    volts = law_output(p, [0.0, 1.0, 1.0, 0.5], np.zeros(4), np.zeros(4), 2)
    np.testing.assert_array_equal(volts[:, 0], [0.0, 0.25, 0.0, -0.25])


def test_biquads_run_in_series():
    p = params(kind=law.SECTIONS, n_sections=2)
    p.sections[0] = (0.0, 1.0, 0.0, 0.0, 0.0)  # one tick late
    p.sections[1] = (1.0, 0.0, 0.0, -0.5, 0.0)  # y = x + y_last / 2
    volts = law_output(p, [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.125], np.zeros(4), 1)
    np.testing.assert_array_equal(volts[:, 0], [0.0, 1.0, 0.5, 0.375])


def test_law_uses_quantised_readings():
    p = params(kind=law.SECTIONS, n_sections=1, resolution=0.5, shift=0.0, origin=2.0)
    p.sections[0] = (1.0, 0.0, 0.0, 0.0, 0.0)
    volts = law_output(p, np.zeros(3), np.zeros(3), [0.0, 0.49, -0.01], 1)
    np.testing.assert_array_equal(volts[:, 0], [-1.0, -1.0, -0.5])


def test_unknown_law_outputs_zero():
    np.testing.assert_array_equal(law_output(params(), [1.0, 2.0], np.ones(2), np.ones(2), 1), np.zeros((2, 1)))
