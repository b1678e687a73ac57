"""Board process in place of the emulated plant: which outputs reach the card, and when they are switched off."""

import sys
from pathlib import Path

import numpy as np
import pytest

from rtctl import machines
from rtctl.daemon import board_plant
from rtctl.daemon.board_plant import BoardPlant
from rtctl.drivers import daq_stc
from rtctl.drivers.board import BoardError
from rtctl.drivers.comedi import ComediSettings
from rtctl.loop.records import PLANT_STATUS
from rtctl.loop.shm_link import INPUTS_SLOT, OUTPUTS_SLOT
from rtctl.machines.wiring import wiring
from rtctl.tick import frames, safety

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers"))
import rigs

STEP = 20 / 4096


class Stand:
    """Board plant called in the test process; the test plays the loop's end of the link."""

    def __init__(self, config):
        self.rig = rigs.emulated(wiring(config))
        self.status, self.samples = np.zeros(1, PLANT_STATUS), np.zeros(1, INPUTS_SLOT)
        self.orders = np.zeros(1, OUTPUTS_SLOT)
        machine = machines.build(config)
        self.plant = BoardPlant(machine, "shm", self.status, self.samples, self.orders, self.rig.card)
        self.tx = np.zeros(1, frames.OUTPUTS)
        self.tx["magic"], self.tx["version"] = frames.MAGIC, frames.VERSION

    def order(self, codes, state=safety.RUNNING, lines=0, age=0.0):
        """Send outputs that answer a sample of `age` s ago, run one turn of the board, return its new sample."""
        self.tx["seq"] += 1
        self.tx["ao_codes"][0][: len(codes)] = codes
        self.tx["state"], self.tx["dio_lines"] = state, lines
        self.tx["inputs_t_ns"] = board_plant.now() - round(age * 1e9)
        self.orders["frame"] = self.tx
        self.orders["count"] += 2  # a slot is a sequence lock
        self.plant.turn()
        return self.samples["frame"][0]

    @property
    def volts(self):
        return [self.rig.output(o.channel) for o in self.rig.card.wiring.outputs]


@pytest.fixture
def stand(config):
    """`stand("ivu")`: a board with the wiring of that machine and a long link timeout."""

    def make(kind="ivu", **changes):
        changes = {"safety.link_timeout": 100.0, "loop.realtime": "off", **changes}
        return Stand(config(kind, mode="real", set=changes).model_copy(update={"driver": ComediSettings()}))

    return make


def test_board_writes_output_codes_and_returns_numbered_samples(stand):
    ivu = stand()
    ivu.rig.pulse(0, 42)
    ivu.rig.set_input(1, 2.5)
    sample = ivu.order((100, -200))
    assert ivu.volts == [100 * STEP, -200 * STEP]
    assert sample["counter_codes"][0] == daq_stc.INITIAL_COUNT + 42
    assert list(sample["ai_codes"][:2]) == [0, 1024]
    assert (sample["outputs_seq"], sample["seq"]) == (1, 1)
    assert np.isnan(sample["truth"]).all()


def test_outputs_are_zero_in_state_idle_whatever_codes_the_frame_holds(stand):
    ivu = stand()
    ivu.order((100, 100))
    ivu.order((100, 100), safety.IDLE)
    assert ivu.volts == [0.0, 0.0]


def test_outputs_only_shrink_after_a_trip(stand):
    ivu = stand()
    ivu.order((100, -100))
    ivu.order((60, -101), safety.TRIPPED)
    assert ivu.volts == [60 * STEP, 0.0]
    ivu.order((80, -1), safety.TRIPPED)
    assert ivu.volts == [0.0, 0.0]


def test_outputs_older_than_the_link_timeout_are_switched_off(stand):
    ivu = stand()
    ivu.order((100, 100), age=99.0)
    assert ivu.volts == [100 * STEP, 100 * STEP]
    ivu.order((100, 100), age=101.0)
    assert ivu.volts == [0.0, 0.0]


def test_outputs_go_to_zero_when_the_loop_stops_sending(stand):
    ivu = stand(**{"safety.link_timeout": 0.05})
    ivu.order((100, 100))
    begun = board_plant.now()
    while any(ivu.volts):  # no more orders come
        ivu.plant.turn()
        assert board_plant.now() - begun < 10e9
    assert board_plant.now() - begun > 0.04e9


def test_ldu_board_sets_the_direction_line_and_reads_both_counters(stand):
    ldu = stand("ldu")
    ldu.rig.pulse(1, -3)
    sample = ldu.order((10,), lines=0b1)
    assert (ldu.rig.line(0), ldu.volts) == (1, [10 * STEP])
    assert list(sample["counter_codes"][:2]) == [daq_stc.INITIAL_COUNT, daq_stc.INITIAL_COUNT - 3]


def test_card_failure_while_running_ends_the_board_with_outputs_off(stand):
    ivu = stand()
    ivu.order((100, 100))
    ivu.rig.fail("inputs")
    with pytest.raises(BoardError, match="pulled out"):
        ivu.plant.run()
    assert ivu.volts == [0.0, 0.0]
    assert ivu.status["ended"][0] == 1


def test_stop_request_zeroes_the_outputs_and_closes_the_card(stand):
    ivu = stand()
    ivu.order((100, 100))
    ivu.status["stop"] = 1
    ivu.plant.run()
    assert ivu.volts == [0.0, 0.0]
    assert not ivu.rig.card.is_open


def test_card_of_a_killed_process_is_reopened_and_zeroed(config, monkeypatch):
    settings = config("ivu", mode="real")
    rig = rigs.emulated(wiring(settings))
    rig.card.open()
    rig.card.write((100, 100), 0)
    monkeypatch.setattr(board_plant, "make", lambda *_: rig.card)
    assert board_plant.zero(settings) is None
    assert [rig.output(c) for c in (0, 1)] == [0.0, 0.0]
    rig.fail("outputs")
    assert "pulled out" in board_plant.zero(settings)
