"""A board in the plant's place: what reaches the card, and when it does not."""

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
    """A board process without the process: the loop's end of the link in a test's hands."""

    def __init__(self, config):
        self.rig = rigs.emulated(wiring(config))
        self.status, self.samples = np.zeros(1, PLANT_STATUS), np.zeros(1, INPUTS_SLOT)
        self.orders = np.zeros(1, OUTPUTS_SLOT)
        machine = machines.build(config)
        self.plant = BoardPlant(machine, "shm", self.status, self.samples, self.orders, self.rig.card)
        self.tx = np.zeros(1, frames.OUTPUTS)
        self.tx["magic"], self.tx["version"] = frames.MAGIC, frames.VERSION

    def order(self, codes, state=safety.RUNNING, lines=0, age=0.0):
        """Send outputs that answer a sample of `age` s ago, have one turn of the board, and read what it sampled."""
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
    """`stand("ivu")`: a board with that machine's wiring; a link that is not in a hurry."""

    def make(kind="ivu", **changes):
        changes = {"safety.link_timeout": 100.0, "loop.realtime": "off", **changes}
        return Stand(config(kind, mode="real", set=changes).model_copy(update={"driver": ComediSettings()}))

    return make


def test_codes_go_out_and_samples_come_back_with_the_frames_numbers(stand):
    ivu = stand()
    ivu.rig.pulse(0, 42)
    ivu.rig.set_input(1, 2.5)
    sample = ivu.order((100, -200))
    assert ivu.volts == [100 * STEP, -200 * STEP]
    assert sample["counter_codes"][0] == daq_stc.INITIAL_COUNT + 42
    assert list(sample["ai_codes"][:2]) == [0, 1024]
    assert (sample["outputs_seq"], sample["seq"]) == (1, 1)
    assert np.isnan(sample["truth"]).all()


def test_a_machine_that_is_off_has_no_volts_whatever_its_frame_says(stand):
    ivu = stand()
    ivu.order((100, 100))
    ivu.order((100, 100), safety.IDLE)
    assert ivu.volts == [0.0, 0.0]


def test_after_a_trip_outputs_only_shrink(stand):
    ivu = stand()
    ivu.order((100, -100))
    ivu.order((60, -101), safety.TRIPPED)
    assert ivu.volts == [60 * STEP, 0.0]
    ivu.order((80, -1), safety.TRIPPED)
    assert ivu.volts == [0.0, 0.0]


def test_outputs_that_answer_an_old_sample_are_off(stand):
    ivu = stand()
    ivu.order((100, 100), age=99.0)
    assert ivu.volts == [100 * STEP, 100 * STEP]
    ivu.order((100, 100), age=101.0)
    assert ivu.volts == [0.0, 0.0]


def test_a_loop_that_is_gone_leaves_nothing_on(stand):
    ivu = stand(**{"safety.link_timeout": 0.05})
    ivu.order((100, 100))
    begun = board_plant.now()
    while any(ivu.volts):  # no more orders come
        ivu.plant.turn()
        assert board_plant.now() - begun < 10e9
    assert board_plant.now() - begun > 0.04e9


def test_the_direction_line_and_both_counters_of_the_ldu(stand):
    ldu = stand("ldu")
    ldu.rig.pulse(1, -3)
    sample = ldu.order((10,), lines=0b1)
    assert (ldu.rig.line(0), ldu.volts) == (1, [10 * STEP])
    assert list(sample["counter_codes"][:2]) == [daq_stc.INITIAL_COUNT, daq_stc.INITIAL_COUNT - 3]


def test_a_card_that_fails_while_it_runs_ends_it_with_the_outputs_off(stand):
    ivu = stand()
    ivu.order((100, 100))
    ivu.rig.fail("inputs")
    with pytest.raises(BoardError, match="pulled out"):
        ivu.plant.run()
    assert ivu.volts == [0.0, 0.0]
    assert ivu.status["ended"][0] == 1


def test_told_to_stop_it_leaves_zero_behind(stand):
    ivu = stand()
    ivu.order((100, 100))
    ivu.status["stop"] = 1
    ivu.plant.run()
    assert ivu.volts == [0.0, 0.0]
    assert not ivu.rig.card.is_open


def test_the_card_of_a_process_that_was_killed_is_opened_anew_and_zeroed(config, monkeypatch):
    settings = config("ivu", mode="real")
    rig = rigs.emulated(wiring(settings))
    rig.card.open()
    rig.card.write((100, 100), 0)
    monkeypatch.setattr(board_plant, "make", lambda *_: rig.card)
    assert board_plant.zero(settings) is None
    assert [rig.output(c) for c in (0, 1)] == [0.0, 0.0]
    rig.fail("outputs")
    assert "pulled out" in board_plant.zero(settings)
