"""Common requirements of every card, emulated or real."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rtctl.drivers import daq_stc
from rtctl.drivers.at_mio_16de import AnalogInputSettings, AnalogOutputSettings
from rtctl.drivers.board import BoardError, Wiring
from rtctl.tick import frames

KINDS = ("emulated", "comedi", "comedi of 16 bits", "nidaqmx", "can", "serial")
OUT_STEP = 20 / 4096
CODES = st.integers(-2048, 2047)


@pytest.fixture
def frame():
    return np.zeros(1, frames.INPUTS)[0]


@pytest.fixture(params=KINDS)
def wired(request, rig):
    """An open card of each kind, with its wires."""
    made = rig(request.param)
    made.card.open()
    return made


def test_outputs_are_zero_at_the_start(wired):
    assert [wired.output(c) for c in (0, 1)] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert wired.line(2) == 0


@pytest.mark.parametrize("codes", [(1, -1), (2047, -2048), (-2048, 2047), (0, 1000)])
def test_code_gives_its_voltage(wired, codes):
    wired.card.write(codes, 0)
    assert [wired.output(c) for c in (0, 1)] == pytest.approx([c * OUT_STEP for c in codes], abs=4e-4)


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(codes=st.tuples(CODES, CODES), lines=st.integers(0, 255))
def test_every_code_is_within_a_step_of_its_voltage_and_sets_only_its_line(wired, codes, lines):
    others = [wired.line(n) for n in range(8) if n != 2]
    wired.card.write(codes, lines)
    assert [wired.output(c) for c in (0, 1)] == pytest.approx([c * OUT_STEP for c in codes], abs=4e-4)
    assert wired.line(2) == (lines >> 2 & 1 if wired.card.wiring.lines else 0)
    assert [wired.line(n) for n in range(8) if n != 2] == others


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(unipolar=st.floats(-1, 12), bipolar=st.floats(-7, 7))
def test_input_voltage_becomes_the_nearest_code(wired, frame, unipolar, bipolar):
    wired.set_input(0, unipolar)
    wired.set_input(1, bipolar)
    wired.card.read(frame)
    step = 10 / 4096
    assert frame["ai_codes"][0] == pytest.approx(min(max(unipolar / step, 0), 4095), abs=0.5 + wired.step / step)
    assert frame["ai_codes"][1] == pytest.approx(min(max(bipolar / step, -2048), 2047), abs=0.5 + wired.step / step)
    assert not frame["ai_codes"][2:].any()


def test_counters_start_at_mid_range_and_count_in_both_directions(wired, frame):
    wired.pulse(0, 100)
    wired.pulse(1, -7)
    wired.card.read(frame)
    assert list(frame["counter_codes"][:2]) == [daq_stc.INITIAL_COUNT + 100, daq_stc.INITIAL_COUNT - 7]
    wired.pulse(0, -300)
    wired.card.read(frame)
    assert frame["counter_codes"][0] == daq_stc.INITIAL_COUNT - 200


def test_counter_wraps_at_24_bits(wired, frame):
    s = np.zeros(1, daq_stc.READER_STATE)[0]
    total = 0
    for step in (5_000_000, 5_000_000, 5_000_000, -6_000_000, -6_000_000, -6_000_000):
        wired.pulse(0, step)
        total += step
        wired.card.read(frame)
        assert daq_stc.counter_position(s, frame["counter_codes"][0]) == total


@pytest.mark.parametrize(
    ("what", "words"),
    [("inputs", "input|Scan|pulled|present|currents|fault 7"), ("counters", "counter|pulled|driver fault|fault 7")],
)
def test_failed_read_zeroes_the_outputs_and_names_the_channel(wired, frame, what, words):
    wired.card.write((500, -500), 0xFF)
    wired.fail(what)
    with pytest.raises(BoardError, match=words) as error:
        wired.card.read(frame)
    assert wired.card.name in str(error.value)
    assert [wired.output(c) for c in (0, 1)] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert wired.line(2) == 0
    assert wired.card.failed is error.value


def test_failure_of_one_output_zeroes_the_other(wired):
    wired.card.write((500, -500), 0)
    wired.fail("outputs")
    with pytest.raises(BoardError, match=r"output|present|pulled|could not be sent"):
        wired.card.write((600, -600), 0)


@pytest.mark.parametrize("codes", [(2048, 0), (0, -2049), (1 << 20, 0)])
def test_code_out_of_range_is_never_written(wired, codes):
    wired.card.write((500, -500), 0)
    with pytest.raises(BoardError, match="-2048 to 2047"):
        wired.card.write(codes, 0)
    assert [wired.output(c) for c in (0, 1)] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_close_zeroes_the_outputs_and_can_be_repeated(wired, frame):
    wired.card.write((500, -500), 0xFF)
    wired.card.close()
    wired.card.close()
    assert [wired.output(c) for c in (0, 1)] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert wired.line(2) == 0
    for call in (lambda: wired.card.read(frame), lambda: wired.card.write((0, 0), 0)):
        with pytest.raises(BoardError, match="not open"):
            call()


@pytest.mark.parametrize("kind", KINDS)
def test_machine_without_inputs_and_lines_reads_its_counter(rig, kind, frame):
    made = rig(kind, Wiring((AnalogOutputSettings(channel=1, polarity="unipolar"),), counters=1))
    made.card.open()
    made.card.write((4095,), 0xFF)
    assert made.output(1) == pytest.approx(10.0, abs=OUT_STEP)
    made.pulse(0, 3)
    made.card.read(frame)
    assert list(frame["counter_codes"][:2]) == [daq_stc.INITIAL_COUNT + 3, 0]


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "comedi"])  # that card has 12 bits
@pytest.mark.parametrize("code", [12345, -32768, 32767, 1])
def test_sixteen_bit_converter(rig, kind, frame, code):
    output = AnalogOutputSettings(channel=0, bits=16)
    made = rig(kind, Wiring((output,), (AnalogInputSettings(channel=0, bits=16),), counters=1))
    made.card.open()
    made.card.write((code,), 0)
    assert made.output(0) == pytest.approx(code * 20 / 65536, abs=2e-4)
    made.set_input(0, 1.2345)
    made.card.read(frame)
    assert frame["ai_codes"][0] == pytest.approx(1.2345 / (10 / 65536), abs=0.5 + made.step / (10 / 65536))
    with pytest.raises(BoardError, match="-32768 to 32767"):
        made.card.write((32768,), 0)
