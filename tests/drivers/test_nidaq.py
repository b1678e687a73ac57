import pytest

from rtctl.drivers import nidaq as ni


def start(board):
    """MdlStart of the example in appendix D: two outputs, three inputs, two encoders."""
    assert board.Init_DA_Brds(1) == 37
    board.MIO_Config(1, 0, 0)
    board.AI_Configure(1, 0, 1, 0, 0, 0)
    board.AI_Configure(1, 1, 1, 0, 0, 0)
    board.AI_Configure(1, 2, 1, 0, 1, 0)
    board.SCAN_Setup(1, 3, (0, 1, 2), (-1, 5, 1))
    board.AO_Configure(1, 0, 0, 0, 10, 0)
    board.AO_Configure(1, 1, 0, 0, 10, 0)
    counters = (ni.ND_COUNTER_0, ni.ND_COUNTER_1)
    for c in counters:
        board.GPCTR_Control(1, c, ni.ND_RESET)
    for c in counters:
        board.GPCTR_Set_Application(1, c, ni.ND_SIMPLE_EVENT_CNT)
    for c in counters:
        board.GPCTR_Change_Parameter(1, c, ni.ND_UP_DOWN, ni.ND_HARDWARE)
    for c in counters:
        board.GPCTR_Change_Parameter(1, c, ni.ND_INITIAL_COUNT, 8388608)
    for c in counters:
        board.GPCTR_Control(1, c, ni.ND_PROGRAM)


def terminate(board):
    """MdlTerminate."""
    board.AO_VWrite(1, 0, 0)
    board.AO_VWrite(1, 1, 0)
    board.GPCTR_Control(1, ni.ND_COUNTER_0, ni.ND_RESET)
    board.GPCTR_Control(1, ni.ND_COUNTER_1, ni.ND_RESET)


@pytest.fixture
def board():
    board = ni.EmulatedBoard()
    start(board)
    return board


def test_example_of_appendix_d_runs(board):
    board.input_volts[:3] = [9.0, 0.5, 7.5]
    board.dio[6], board.dio[7] = 1, 0
    board.pulse(0, 100)
    board.pulse(1, 30)

    assert board.AI_VRead_Scan(1) == pytest.approx([9.0, 0.5, 7.5], abs=10 / 4096)
    assert board.GPCTR_Watch(1, ni.ND_COUNTER_0, ni.ND_COUNT) == 8388708
    assert board.GPCTR_Watch(1, ni.ND_COUNTER_1, ni.ND_COUNT) == 8388578
    assert board.GPCTR_Watch(1, ni.ND_COUNTER_1, ni.ND_COUNT) == 8388578
    board.AO_VWrite(1, 0, 2.5)
    board.AO_VWrite(1, 1, -20.0)
    assert [board.output_volts(c) for c in (0, 1)] == [2.5, -10.0]

    terminate(board)
    assert [board.output_volts(c) for c in (0, 1)] == [0.0, 0.0]
    board.pulse(0, 5)
    assert [board.GPCTR_Watch(1, c, ni.ND_COUNT) for c in (ni.ND_COUNTER_0, ni.ND_COUNTER_1)] == [0, 0]


def test_input_beyond_its_range_reads_the_range_limit(board):
    board.input_volts[:3] = [-99.0, 99.0, -1.0]
    assert board.AI_VRead_Scan(1) == pytest.approx([-10.0, 1.0 - 2 / 4096, 0.0])


def test_external_reference_sets_the_range(board):
    board.AO_Configure(1, 0, 1, 1, 4.096, 0)
    board.AO_VWrite(1, 0, 99.0)
    assert board.output_volts(0) == pytest.approx(4.095)


@pytest.mark.parametrize(
    ("call", "name", "words"),
    [
        (lambda b: b.AO_VWrite(2, 0, 0.0), "badDeviceError", "device 2 does not exist"),
        (lambda b: b.AO_VWrite(1, 2, 0.0), "badChanError", "0 and 1 do"),
        (lambda b: b.AI_Configure(1, 16, 1, 0, 0, 0), "badChanError", "0 to 15 do"),
        (lambda b: b.AI_Configure(1, 8, 0, 0, 0, 0), "badChanError", "pair"),
        (lambda b: b.AI_Configure(1, 0, 3, 0, 0, 0), "badInputModeError", "0, 1 or 2"),
        (lambda b: b.AI_Configure(1, 0, 1, 0, 2, 0), "badPolarityError", "0 or 1"),
        (lambda b: b.SCAN_Setup(1, 2, (0,), (1,)), "invalidValueError", "2 channels"),
        (lambda b: b.SCAN_Setup(1, 1, (5,), (1,)), "noSetupError", "input 5"),
        (lambda b: b.SCAN_Setup(1, 1, (0,), (0.5,)), "badGainError", "-1"),
        (lambda b: b.SCAN_Setup(1, 1, (2,), (-1,)), "badRPGError", "bipolar only"),
        (lambda b: b.SCAN_Setup(1, 2, (1, 0), (1, 1)), "badChanError", "ascending"),
        (lambda b: b.AO_Configure(1, 0, 0, 1, 12, 0), "badExtRefError", "12 V"),
        (lambda b: b.GPCTR_Control(1, 0, ni.ND_RESET), "gpctrBadCtrNumberError", "ND_COUNTER_0"),
        (lambda b: b.GPCTR_Control(1, ni.ND_COUNTER_0, 1), "gpctrBadActionError", "ND_PROGRAM"),
        (lambda b: b.GPCTR_Set_Application(1, ni.ND_COUNTER_0, 1), "gpctrBadApplicationError", "EVENT"),
        (lambda b: b.GPCTR_Watch(1, ni.ND_COUNTER_0, 1), "gpctrBadEntityIDError", "ND_COUNT"),
        (
            lambda b: b.GPCTR_Change_Parameter(1, ni.ND_COUNTER_0, ni.ND_INITIAL_COUNT, 1 << 24),
            "gpctrBadParamValueError",
            "16777215",
        ),
    ],
)
def test_refused_call_returns_the_ni_daq_code_and_a_reason(board, call, name, words):
    with pytest.raises(ni.NidaqError, match=words) as error:
        call(board)
    assert (error.value.name, error.value.code) == (name, ni.CODES[name])


def test_calls_before_their_setup_are_refused():
    board = ni.EmulatedBoard()
    for call in (
        lambda: board.AI_VRead_Scan(1),
        lambda: board.AO_VWrite(1, 0, 1.0),
        lambda: board.GPCTR_Control(1, ni.ND_COUNTER_0, ni.ND_PROGRAM),
    ):
        with pytest.raises(ni.NidaqError, match="-10600"):
            call()
