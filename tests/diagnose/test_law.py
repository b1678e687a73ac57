"""The compiled law against the one that recomputes a recording's voltages column by column."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose import law
from rtctl.diagnose.record import load_record, recompute_law
from rtctl.diagnose.simulate import law_params
from rtctl.idiom import fill_record, record_dtype, tick

BUNDLES = ("case-0001", "case-0002", "case-0003", "case-0004", "case-0005", "case-0006", "case-0007", "case-0018")


@tick
def replay(ps, ss, ref, w, reading, volts):
    for k in range(len(ref)):
        law.step(ps[0], ss[0], ref[k], w[k], reading[k], volts[k])


def written(params: law.LawParams, ref: Any, w: Any, reading: Any, drives: int) -> np.ndarray:
    """What the law writes for these rows, (n, drives) V."""
    p = np.zeros(1, record_dtype(params))
    fill_record(p[0], params)
    volts = np.zeros((len(ref), drives))
    replay(p, np.zeros(1, law.LAW_STATE), np.array(ref, float), np.array(w, float), np.array(reading, float), volts)
    return volts


def params(**values: Any) -> law.LawParams:
    plain: dict[str, Any] = dict.fromkeys(law.LawParams._fields, 0.0)
    plain |= {"allocation": 0, "n_sections": 0, "sections": np.zeros((law.MAX_SECTIONS, 5))}
    return law.LawParams(**{**plain, "Ts": 1e-3, "to_unit": 1.0, "limit": 10.0, "top": 10.0, **values})


@pytest.mark.parametrize("name", BUNDLES)
def test_on_a_recording_it_writes_the_recomputed_voltages_to_the_bit(practice, name):
    record = load_record(practice / name)
    again = recompute_law(record)
    assert again is not None
    reading = next(iter(record.y.values()))
    volts = written(law_params(record), record.ref, record.w, reading, record.u.shape[1])
    if record.case.drive.step_volt:  # cut to the DAC's steps, nothing is left of the order of the sums
        np.testing.assert_array_equal(volts, again)
    else:
        np.testing.assert_allclose(volts, again, rtol=0, atol=1e-9)


def test_on_the_axis_it_writes_the_recomputed_voltages(plain):
    record = plain.record
    again = recompute_law(record)
    volts = written(law_params(record), record.ref, record.w, record.y["x"], 1)
    np.testing.assert_allclose(volts, again, rtol=0, atol=1e-9)
    assert np.ptp(again) > 1.0


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=12), st.floats(0.5, 10.0), st.integers(2, 12))
def test_volts_stay_within_the_limit_and_on_the_steps_of_the_dac(ref, limit, bits):
    lsb = 20.0 / 2**bits
    p = params(kind=law.CASCADE, kp=160.0, kv=243.0, limit=limit, lsb=lsb, top=10.0 - lsb)
    volts = written(p, ref, np.zeros(len(ref)), np.zeros(len(ref)), 1)
    steps = volts / lsb
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.abs(volts).max() <= limit + 0.5 * lsb + 1e-12
    assert volts.max() <= 10.0 - lsb + 1e-12


def test_half_a_step_of_the_dac_goes_up_on_both_sides_of_zero():
    p = params(kind=law.SECTIONS, n_sections=1, lsb=1.0, top=9.0)
    p.sections[0] = (1.0, 0.0, 0.0, 0.0, 0.0)
    volts = written(p, [0.5, -0.5, 1.5, -1.5, 9.9], np.zeros(5), np.zeros(5), 1)
    np.testing.assert_array_equal(volts[:, 0], [1.0, 0.0, 2.0, -1.0, 9.0])


@pytest.mark.parametrize(("name", "wanted"), [
    ("pull", (1.0 + 3.0, 2.0)), ("differential", (1.0 + 1.5, 2.0 - 1.5)), ("motor1", (1.0 + 3.0, 2.0)),
    ("motor2", (1.0, 2.0 - 3.0)),
])  # fmt: skip
def test_each_allocation_shares_a_forward_command_as_its_name_says(name, wanted):
    p = params(kind=law.PD, P=3.0, a=1.0, pull1=1.0, pull2=2.0, allocation=law.ALLOCATIONS.index(name))
    np.testing.assert_allclose(written(p, [1.0], [0.0], [0.0], 2)[0], wanted, rtol=1e-15)


def test_pull_gives_a_backward_command_to_the_other_motor():
    p = params(kind=law.PD, P=3.0, a=1.0, pull1=1.0, pull2=2.0)
    np.testing.assert_allclose(written(p, [-1.0], [0.0], [0.0], 2)[0], [1.0, 5.0])


def test_friction_compensation_follows_the_step_of_the_reference():
    p = params(kind=law.PD, friction=0.25, allocation=2)
    volts = written(p, [0.0, 1.0, 1.0, 0.5], np.zeros(4), np.zeros(4), 2)
    np.testing.assert_array_equal(volts[:, 0], [0.0, 0.25, 0.0, -0.25])


def test_biquads_run_one_after_the_other():
    p = params(kind=law.SECTIONS, n_sections=2)
    p.sections[0] = (0.0, 1.0, 0.0, 0.0, 0.0)  # one tick late
    p.sections[1] = (1.0, 0.0, 0.0, -0.5, 0.0)  # y = x + y_last / 2
    volts = written(p, [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.125], np.zeros(4), 1)
    np.testing.assert_array_equal(volts[:, 0], [0.0, 1.0, 0.5, 0.375])
