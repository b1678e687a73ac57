import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.drivers import at_mio_16de as mio

DT = 0.002
finite = st.floats(-30, 30)


def output(**keys):
    return mio.build_output(mio.AnalogOutputSettings(**{"channel": 0, **keys}), DT)


def analog_input(**keys):
    board = {k: keys.pop(k) for k in ("dither", "scan_index", "seed") if k in keys}
    return mio.build_input(mio.AnalogInputSettings(**{"channel": 0, **keys}), DT, **board)


def record(dtype):
    return np.zeros(1, dtype)[0]


OUTPUTS = [
    output(),
    output(polarity="unipolar"),
    output(reference="external", external_volts=-11.0),
    output(reference="external", external_volts=2.5, polarity="unipolar"),
]


def test_output_step_is_the_reference_over_2048_or_4096():
    assert OUTPUTS[0].volts_per_code == pytest.approx(4.8828125e-3)
    assert OUTPUTS[1].volts_per_code == pytest.approx(2.44140625e-3)
    assert mio.volts_to_codes(OUTPUTS[0], 99.0) == 2047
    assert mio.volts_to_codes(OUTPUTS[0], -math.inf) == -2048
    assert mio.volts_to_codes(OUTPUTS[1], -1.0) == 0
    assert mio.volts_to_codes(OUTPUTS[2], 99.0) == -2048  # a negative reference inverts the range


@settings(deadline=None)
@given(finite, st.sampled_from(OUTPUTS))
def test_output_is_within_half_a_code_of_the_command_or_at_its_limit(volts, p):
    codes = mio.volts_to_codes(p, volts)
    back = mio.codes_to_volts(p, codes)
    ends = sorted((p.code_min * p.volts_per_code, p.code_max * p.volts_per_code))
    wanted = min(max(volts, ends[0]), ends[1])
    assert p.code_min <= codes <= p.code_max
    assert abs(back - wanted) <= 0.5 * abs(p.volts_per_code) * (1 + 1e-9)


@settings(deadline=None)
@given(st.integers(-2048, 2047))
def test_codes_survive_a_round_trip_through_volts(codes):
    assert mio.volts_to_codes(OUTPUTS[0], mio.codes_to_volts(OUTPUTS[0], codes)) == codes


def test_nan_command_is_zero_volts():
    assert mio.volts_to_codes(OUTPUTS[0], math.nan) == 0
    assert mio.input_step(analog_input(), record(mio.ANALOG_INPUT_STATE), math.nan) == 0


def test_new_code_acts_after_its_write_and_settles_in_3_us():
    p, s, h = OUTPUTS[0], record(mio.ANALOG_OUTPUT_STATE), 100e-6
    late = (1e-6 + 1.5e-6) / h  # the write, and half of the linear rise
    assert mio.output_step(p, s, 1024, h) == pytest.approx(5.0 * (1 - late))
    assert mio.output_step(p, s, 1024, h) == 5.0
    assert mio.output_step(p, s, -1024, h) == pytest.approx(5.0 * late - 5.0 * (1 - late))
    s = record(mio.ANALOG_OUTPUT_STATE)
    assert [mio.output_step(p, s, 1024, step) for step in (1e-6, 1.5e-6, 1.5e-6)] == pytest.approx([0, 1.25, 3.75])


def test_second_output_is_written_one_microsecond_later():
    first, second = (mio.output_step(output(channel=c), record(mio.ANALOG_OUTPUT_STATE), 2000, 1e-4) for c in (0, 1))
    assert (first - second) * 1e-4 == pytest.approx(2000 * 10 / 2048 * 1e-6)
    alone = mio.build_output(mio.AnalogOutputSettings(channel=1), DT, write_order=0)
    assert mio.output_step(alone, record(mio.ANALOG_OUTPUT_STATE), 2000, 1e-4) == first


@settings(deadline=None)
@given(st.integers(1, 400), st.integers(-2048, 2047), st.integers(-2048, 2047))
def test_mean_output_does_not_depend_on_the_step_size(pieces, before, after):
    p, h = OUTPUTS[0], 20e-6
    whole, cut = record(mio.ANALOG_OUTPUT_STATE), record(mio.ANALOG_OUTPUT_STATE)
    for s in (whole, cut):
        mio.output_step(p, s, before, h)
    mean = np.mean([mio.output_step(p, cut, after, h / pieces) for _ in range(pieces)])
    assert mean == pytest.approx(mio.output_step(p, whole, after, h), abs=1e-9)


INPUTS = [
    analog_input(),
    analog_input(gain=0.5),
    analog_input(gain=100.0),
    analog_input(polarity="unipolar"),
    analog_input(gain=20, polarity="unipolar", mode="nrse"),
]


@settings(deadline=None)
@given(finite, st.sampled_from(INPUTS))
def test_input_is_within_half_a_code_of_its_voltage_or_at_its_limit(volts, p):
    codes = mio.input_step(p, record(mio.ANALOG_INPUT_STATE), volts)
    wanted = min(max(volts, p.code_min * p.volts_per_code), p.code_max * p.volts_per_code)
    assert abs(mio.codes_to_input_volts(p, codes) - wanted) <= 0.5 * p.volts_per_code * (1 + 1e-9)


def test_input_ranges_of_gain_and_polarity():
    for keys, low, high in [
        ({}, -5, 5), ({"gain": 0.5}, -10, 10), ({"gain": 100}, -0.05, 0.05), ({"polarity": "unipolar"}, 0, 10),
    ]:  # fmt: skip
        p = analog_input(**keys)
        assert p.code_min * p.volts_per_code == pytest.approx(low)
        assert (p.code_max + 1) * p.volts_per_code == pytest.approx(high)
    assert analog_input(scan_index=3).scan_delay == pytest.approx(6e-6)


def codes_of(p, volts, n=20_000):
    s = record(mio.ANALOG_INPUT_STATE)
    return np.array([mio.input_step(p, s, volts) for _ in range(n)])


def test_dither_resolves_the_mean_below_a_code():
    p = analog_input(dither=True, seed=7)
    assert np.mean(codes_of(p, 0.3 * p.volts_per_code)) == pytest.approx(0.3, abs=0.03)
    plain = analog_input()
    assert not codes_of(plain, 0.3 * plain.volts_per_code, 100).any()


def test_dither_is_half_a_code_rms_and_repeats_with_its_seed():
    p = analog_input(dither=True, seed=7)
    x = codes_of(p, 0.0)
    assert np.std(x) == pytest.approx(math.sqrt(0.25 + 1 / 12), rel=0.02)  # dither plus quantisation
    assert np.corrcoef(x[1:], x[:-1])[0, 1] == pytest.approx(0, abs=0.03)
    assert (x[:500] == codes_of(p, 0.0, 500)).all()
    assert (x[:500] != codes_of(analog_input(dither=True, seed=8), 0.0, 500)).any()


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"gain": -1}, "write 0.5"),
        ({"gain": 3}, "no gain 3"),
        ({"gain": 0.5, "polarity": "unipolar"}, "bipolar inputs only"),
        ({"mode": "differential", "channel": 8}, "differential channel 8 does not exist"),
        ({"channel": 16}, "less than or equal to 15"),
        ({"mode": "floating"}, "differential"),
    ],
)
def test_invalid_input_is_refused(keys, words):
    with pytest.raises(ValidationError, match=words):
        mio.AnalogInputSettings(**{"channel": 0, **keys})


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"reference": "external"}, "needs 'external_volts'"),
        ({"reference": "external", "external_volts": 0}, "other than 0"),
        ({"reference": "external", "external_volts": 12}, "between -11 and 11 V"),
        ({"external_volts": 5}, "reference is internal"),
        ({"channel": 2}, "0 or 1"),
    ],
)
def test_invalid_output_is_refused(keys, words):
    with pytest.raises(ValidationError, match=words):
        mio.AnalogOutputSettings(**{"channel": 0, **keys})


def scan(*items):
    return [mio.AnalogInputSettings(channel=c, mode=m) for c, m in items]


def test_scan_order_is_ascending_without_duplicates():
    mio.check_inputs(scan((0, "differential"), (1, "differential"), (2, "rse"), (10, "nrse")))
    with pytest.raises(ValueError, match="differential input 1 uses input 9 too"):
        mio.check_inputs(scan((1, "differential"), (9, "rse")))
    for channels in ((1, 0), (2, 2)):
        with pytest.raises(ValueError, match="ascending, each once"):
            mio.check_inputs(scan(*((c, "rse") for c in channels)))
    with pytest.raises(ValueError, match="within 0 to 1"):
        mio.check_channels("analog outputs", [0, 2], 1)


def test_period_shorter_than_the_scan_is_refused():
    with pytest.raises(ValueError, match="output 1 settles in 5 us"):
        mio.build_output(mio.AnalogOutputSettings(channel=1), 4e-6)
    with pytest.raises(ValueError, match="too short for 3 inputs"):
        mio.build_input(mio.AnalogInputSettings(channel=3), 5e-6, scan_index=2)


@pytest.mark.parametrize(("polarity", "ends"), [("bipolar", (-32768, 32767)), ("unipolar", (0, 65535))])
def test_converter_resolution_is_a_setting(polarity, ends):
    for made, span in ((output(polarity=polarity, bits=16), 20 if polarity == "bipolar" else 10),
                       (analog_input(polarity=polarity, bits=16), 10)):  # fmt: skip
        assert (made.code_min, made.code_max) == ends
        assert made.volts_per_code == pytest.approx(span / 65536)
    with pytest.raises(ValidationError):
        output(bits=40)
