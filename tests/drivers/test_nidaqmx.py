import pytest

from rtctl.config.errors import UserError
from rtctl.drivers.at_mio_16de import AnalogInputSettings, AnalogOutputSettings
from rtctl.drivers.board import Wiring

nidaqmx = pytest.importorskip("nidaqmx", reason="nidaqmx is not installed")
ONE = Wiring((AnalogOutputSettings(channel=0),))


@pytest.mark.parametrize(
    ("wiring", "settings", "words"),
    [
        (ONE, {"device": "Dev2"}, "there is no Dev2; DAQmx has Dev1; did you mean 'Dev1'"),
        (Wiring((AnalogOutputSettings(channel=0),), counters=3), {}, "Dev1 has no counter ctr2; it has ctr0, ctr1"),
        (
            Wiring((AnalogOutputSettings(channel=0, reference="external", external_volts=4.0),)),
            {},
            "write 'reference: internal'",
        ),
    ],
)
def test_missing_function_of_the_card_is_named(rig, wiring, settings, words):
    made = rig("nidaqmx", wiring, **settings)
    with pytest.raises(UserError, match=words):
        made.card.open()
    assert not made.card.is_open


def test_missing_card_is_an_error(rig, monkeypatch):
    made = rig("nidaqmx", ONE)
    nidaqmx.utils._select_interpreter().devices = []
    with pytest.raises(UserError, match="no card at all; see `nilsdev`"):
        made.card.open()


def test_missing_ni_driver_is_an_error(rig, monkeypatch):
    made = rig("nidaqmx", ONE)

    def missing(*_):
        raise nidaqmx.errors.DaqNotFoundError("Could not find an installation of NI-DAQmx.")

    monkeypatch.setattr(nidaqmx.utils, "_select_interpreter", missing)
    with pytest.raises(UserError, match="NI-DAQmx itself is not installed here"):
        made.card.open()


def test_hardware_timing_is_set_up_at_the_rate(rig):
    wiring = Wiring((AnalogOutputSettings(channel=0),), (AnalogInputSettings(channel=3),))
    made = rig("nidaqmx", wiring, timing="hardware")
    made.card.open()
    assert nidaqmx.utils._select_interpreter().timed == 500.0


def test_ls7084_counts_edges_with_a_direction_line(rig):
    made = rig("nidaqmx", ONE, encoders="ls7084")
    made.card.open()
    made.pulse(0, -4)
    assert made.card._read_counts() == [(1 << 23) - 4]


def test_all_tasks_are_cleared_at_close(rig):
    made = rig("nidaqmx")
    made.card.open()
    tasks = nidaqmx.utils._select_interpreter().tasks
    assert len(tasks) == 5
    made.card.close()
    assert not any(task["open"] for task in tasks.values())
