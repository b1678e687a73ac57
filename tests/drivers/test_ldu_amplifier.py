import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import at_mio_16de as mio
from rtctl.drivers import ldu_amplifier as amplifier

DT = 1e-3
OUTPUTS = [
    mio.build_output(mio.AnalogOutputSettings(channel=0, polarity=polarity), DT) for polarity in ("bipolar", "unipolar")
]


def make(output=OUTPUTS[0], **keys):
    return amplifier.build(amplifier.LduAmplifierSettings(**keys), DT, output.volts_per_code)


MEASURED, COMPENSATED, LINEAR = make(), make(compensate=True), make(kind="linear")


@pytest.mark.parametrize(("volts", "ampere"), [(-1, 0.042), (0, 0.042), (0.8, 0.042), (1.8, 0.142), (3.0, 0.262)])
def test_amplifier_follows_the_measured_curve(volts, ampere):
    assert amplifier.current(MEASURED, float(volts), 1) == pytest.approx(ampere)
    assert amplifier.current(MEASURED, float(volts), 0) == pytest.approx(-ampere)


def test_amplifier_runs_away_just_above_three_volts():
    assert amplifier.current(MEASURED, 3.0001, 1) == 5.0
    assert amplifier.current(LINEAR, 3.0001, 1) == pytest.approx(0.30001)


@settings(deadline=None)
@given(
    st.one_of(st.floats(), st.floats(2.9, 3.1)),
    st.sampled_from(OUTPUTS),
    st.booleans(),
    st.floats(2.5, 3.0),
)
def test_output_limit_of_the_loop_prevents_a_runaway(u, output, compensate, limit):
    p = make(output, compensate=compensate, limit=limit)
    volts = mio.codes_to_volts(output, mio.volts_to_codes(output, amplifier.encode(p, u)))
    assert 0.0 <= volts <= limit
    assert abs(amplifier.current(p, volts, amplifier.direction(p, u))) < 0.27


def test_nearest_unipolar_code_to_three_volts_exceeds_the_runaway_voltage():
    output = OUTPUTS[1]
    assert mio.codes_to_volts(output, mio.volts_to_codes(output, 3.0)) > 3.0


def total(p, u):
    return amplifier.current(p, amplifier.encode(p, u), amplifier.direction(p, u))


@settings(deadline=None)
@given(st.floats(0.42, 2.6), st.sampled_from((-1, 1)))
def test_compensated_amplifier_gives_a_tenth_of_an_ampere_per_volt(u, sign):
    assert total(COMPENSATED, sign * u) == pytest.approx(sign * 0.1 * u, abs=1e-9)


@settings(deadline=None)
@given(st.floats(-0.4199, 0.4199))
def test_smallest_current_is_the_offset_current(u):
    assert abs(total(COMPENSATED, u) - 0.1 * u) <= 0.042
    assert abs(total(COMPENSATED, u)) == 0.042


def test_linear_amplifier_needs_no_compensation():
    p = make(kind="linear", compensate=True)
    assert total(p, -2.0) == pytest.approx(-0.2)


def test_nan_command_is_zero_volts():
    assert amplifier.encode(MEASURED, math.nan) == 0.0


def test_limit_that_allows_a_runaway_is_refused():
    with pytest.raises(ValueError, match="runs away to 5 A"):
        make(limit=3.01)
    make(kind="linear", limit=5.0)
