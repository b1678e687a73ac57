import ctypes

import pytest

from rtctl.config.errors import UserError
from rtctl.drivers.at_mio_16de import AnalogInputSettings, AnalogOutputSettings
from rtctl.drivers.board import BoardError, Wiring
from rtctl.drivers.comedi import ComediCard, ComediSettings, pfi_other

ONE = Wiring((AnalogOutputSettings(channel=0),))


def card(library, wiring=ONE, **settings):
    return ComediCard(ComediSettings(library=str(library), **settings), wiring)


@pytest.fixture
def wires(comedi_library):
    lib = ctypes.CDLL(str(comedi_library))
    for number in (0, 1):
        lib.wire_reset(number)
    lib.wire_output.restype = ctypes.c_double
    return lib


@pytest.mark.parametrize(
    ("device", "words"),
    [
        ("/dev/comedi1", "there is no /dev/comedi1; load the card's module"),
        ("/dev/comedi2", "join its group .*iocard"),
        ("/dev/comedi3", "no card is configured at /dev/comedi3; `comedi_config"),
        ("/dev/comedi5", "busy"),
    ],
)
def test_unopenable_device_file_error_names_the_remedy(comedi_library, device, words):
    with pytest.raises(UserError, match=words):
        card(comedi_library, device=device).open()


@pytest.mark.parametrize(
    ("wiring", "settings", "words"),
    [
        (ONE, {"board": "at-mio-16e-2"}, "is a at-mio-16de-10, not a at-mio-16e-2"),
        (ONE, {"encoders": "quadrature"}, "counter 0 .*quadrature"),
        (Wiring((AnalogOutputSettings(channel=0),), lines=(9,)), {}, "8 digital lines, the config uses number 9"),
        (
            Wiring(
                (AnalogOutputSettings(channel=0),), (AnalogInputSettings(channel=0, gain=20.0, polarity="bipolar"),)
            ),
            {"device": "/dev/comedi0"},
            None,
        ),
        (
            Wiring((AnalogOutputSettings(channel=0, reference="external", external_volts=4.0),)),
            {"device": "/dev/comedi4", "encoders": "quadrature"},
            r"no range of -4 to 4 V by EXTREF; it has -10 to 10, 0 to 10, -1 to 1 x EXTREF",
        ),
    ],
)
def test_card_that_lacks_a_function_is_refused_by_name(wires, comedi_library, wiring, settings, words):
    made = card(comedi_library, wiring, **settings)
    if words is None:
        made.open().close()
        return
    with pytest.raises(UserError, match=words):
        made.open()
    assert not made.is_open
    assert wires.wire_open(0) == wires.wire_open(1) == 0


def test_outputs_locked_by_another_program_are_not_changed(wires, comedi_library):
    wires.wire_lock(0)
    before = wires.wire_raw(0, 0)
    with pytest.raises(UserError, match="belong to another program"):
        card(comedi_library).open()
    assert wires.wire_raw(0, 0) == before


def test_external_reference_scales_the_output(wires, comedi_library):
    made = card(comedi_library, Wiring((AnalogOutputSettings(channel=1, reference="external", external_volts=4.0),)))
    made.open()
    made.write((1024,), 0)
    assert wires.wire_output(0, 1) == 0.5  # of the reference
    made.close()


def test_failure_of_one_output_zeroes_the_other(wires, comedi_library):
    made = card(comedi_library, Wiring((AnalogOutputSettings(channel=0), AnalogOutputSettings(channel=1)))).open()
    made.write((500, 500), 0)
    wires.wire_fail(2, 0)
    with pytest.raises(BoardError, match="writing output 0: Input/output error"):
        made.write((600, 600), 0)
    assert (wires.wire_output(0, 0), wires.wire_output(0, 1)) == (500 * 20 / 4096, 0.0)
    made.close()


def test_card_removed_during_a_run_is_an_error_with_its_name(wires, comedi_library):
    made = card(comedi_library).open()
    wires.wire_break_open(0)
    with pytest.raises(BoardError, match=r"/dev/comedi0 \(at-mio-16de-10\): writing output 0: Bad file"):
        made.write((1,), 0)


def test_counter_lines_are_inputs_and_machine_lines_are_outputs(wires, comedi_library):
    made = card(comedi_library, Wiring((AnalogOutputSettings(channel=0),), counters=2, lines=(3,))).open()
    assert wires.wire_outputs(0) == 1 << 3
    made.close()


def test_missing_comedi_library_is_named(tmp_path):
    with pytest.raises(UserError, match=r"driver.library: .*nothing.so is no libcomedi"):
        card(tmp_path / "nothing.so").open()


def test_library_other_than_comedi_is_refused():
    with pytest.raises(UserError, match=r"is no libcomedi 0\.11"):
        card("libm.so.6").open()


def test_pin_numbers_are_those_of_comedi_h():
    assert [pfi_other(n) for n in (0, 9, 10, 11)] == [1, 10, 0x15, 0x16]
