"""Faults on the frames between loop and machine; equal in every mode of virtual time."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.drivers import daq_stc
from rtctl.drivers.at_mio_16de import AnalogInputSettings, AnalogOutputParams, build_input
from rtctl.faults.cases import COMMON, STANDS
from rtctl.faults.drives import Inside
from rtctl.loop import generate, mailbox
from rtctl.machines.base import Block
from rtctl.tick import faults, frames

TICKS = 60


class Line:
    """Frames through the faults, tick by tick. The board counts `speed` per tick and numbers frames by its tick."""

    def __init__(self, *wanted: faults.Fault, speed: int = 3, begin: int = 0, seed: int = 1):
        self.c, self.f = np.zeros(1, mailbox.COMMAND), np.zeros(1, faults.FAULTS_STATE)
        self.f["seed"] = seed
        faults.fill(self.c[0], wanted)
        made = generate.new_frames()
        self.rx, self.tx, self.wire = made["rx"], made["tx"], made["tx_held"]
        self.board, self.speed, self.k = generate.new_frames()["rx"], speed, begin

    def tick(self, came: int = 1, codes: int = 0) -> tuple[int, int, list[int]]:
        """Number of received frames, sequence number of the seen frame, and output codes at the machine."""
        self.board[0]["seq"] = self.k + 1
        counts = daq_stc.INITIAL_COUNT + self.speed * self.k
        self.board[0]["counter_codes"] = counts & (daq_stc.SIZE - 1)
        if came:
            self.rx[0] = self.board[0]
        fresh = faults.receive(self.c[0], self.f[0], self.rx, came, self.k)
        self.tx[0]["ao_codes"] = codes
        faults.transmit(self.c[0], self.f[0], self.tx, self.wire, self.k)
        self.k += 1
        return int(fresh), int(self.rx[0]["seq"]), self.wire[0]["ao_codes"].tolist()

    def counts(self) -> int:
        return int(self.rx[0]["counter_codes"][0]) - daq_stc.INITIAL_COUNT


def fault(name: str, begin: int, end: int, size: float | None = None, channel: int = 0) -> faults.Fault:
    kind = faults.KINDS[name]
    return faults.Fault(kind.number, channel, begin, end, kind.usual if size is None else size)


# the link


def test_frames_pass_unchanged_without_a_fault() -> None:
    line = Line(fault("link.silent", 1000, 2000))
    assert [line.tick(codes=k) for k in range(20)] == [(1, k + 1, [k] * 4) for k in range(20)]


@given(late=st.integers(1, 20), begin=st.integers(0, 10))
@settings(deadline=None)
def test_link_delay_starts_with_silence_then_delivers_every_frame_in_order(late: int, begin: int) -> None:
    line = Line(fault("link.delay", begin, 50, late))
    seen = [line.tick(codes=k + 1) for k in range(TICKS)]
    for k, (fresh, number, codes) in enumerate(seen):
        if k < begin or k >= 50:
            assert (fresh, number, codes[0]) == (1, k + 1, k + 1)
        elif k < begin + late:
            assert fresh == 0 and (k == 0 or begin == 0 or (number, codes[0]) == (begin, begin))
        else:
            assert (fresh, number, codes[0]) == (1, k - late + 1, k - late + 1)


def test_link_silence_keeps_the_last_frame_in_both_directions() -> None:
    line = Line(fault("link.silent", 5, 9))
    seen = [line.tick(codes=k) for k in range(12)]
    assert seen[4] == (1, 5, [4] * 4)
    assert seen[5:9] == [(0, 5, [4] * 4)] * 4
    assert seen[9] == (1, 10, [9] * 4)


@given(share=st.floats(0.0, 1.0), seed=st.integers(0, 1000))
@settings(deadline=None)
def test_link_loss_drops_whole_frames_and_repeats_with_its_seed(share: float, seed: int) -> None:
    lines = [Line(fault("link.loss", 0, TICKS, share), seed=seed) for _ in range(2)]
    seen = [[line.tick(codes=k) for k in range(TICKS)] for line in lines]
    assert seen[0] == seen[1]
    for k, (fresh, number, _) in enumerate(seen[0][1:], 1):
        assert (fresh, number) in ((1, k + 1), (0, seen[0][k - 1][1]))
    assert share > 0.0 or all(fresh for fresh, _, _ in seen[0])
    assert share < 1.0 or not any(fresh for fresh, _, _ in seen[0])


def test_reordered_frame_arrives_with_the_next_and_the_newest_is_used() -> None:
    line = Line(fault("link.reorder", 0, TICKS, 0.5))
    seen = [line.tick() for _ in range(TICKS)]
    numbers = [number for _, number, _ in seen]
    assert all(b >= a for a, b in pairwise(numbers))
    assert {fresh for fresh, _, _ in seen} == {0, 1, 2}
    assert sum(fresh for fresh, _, _ in seen) in (TICKS, TICKS - 1)


def test_fault_that_starts_in_a_tick_without_a_frame_uses_the_last_frame() -> None:
    line = Line()
    line.rx[0] = line.board[0]
    line.rx[0]["seq"], line.rx[0]["counter_codes"] = 7, daq_stc.INITIAL_COUNT + 100
    faults.fill(line.c[0], [fault("encoder.freeze", 0, 10)])
    line.k = 3
    assert line.tick(came=0)[:2] == (0, 7) and line.counts() == 100


# sensors


@given(speed=st.integers(-2000, 2000), length=st.integers(1, 40))
@settings(deadline=None)
def test_frozen_counter_holds_and_its_missed_counts_are_lost(speed: int, length: int) -> None:
    line, before = Line(fault("encoder.freeze", 10, 10 + length), speed=speed), 0
    for k in range(TICKS):
        line.tick()
        if 10 <= k < 10 + length:
            assert line.counts() == 9 * speed
        elif k:
            assert line.counts() - before == speed
        before = line.counts()


def test_missed_counts_stay_lost_after_the_faults_are_cleared() -> None:
    line = Line(fault("encoder.missed", 0, 10, 0.5), speed=100)
    for _ in range(20):
        line.tick()
    assert line.counts() == 1900 - 450
    faults.fill(line.c[0], [])
    assert line.c[0]["faulty"] == 1 and not line.c[0]["faults"]["kind"].any()
    line.tick()
    assert line.counts() == 2000 - 450


def test_counters_wrap_under_a_fault() -> None:
    line = Line(fault("encoder.missed", 0, TICKS, 0.25), speed=1 << 20)
    position = np.zeros(1, daq_stc.READER_STATE)[0]
    for k in range(TICKS):
        line.tick()
        assert daq_stc.counter_position(position, int(line.rx[0]["counter_codes"][0])) == k * 3 * (1 << 18)


def test_encoder_noise_stays_within_its_size_and_leaves_no_offset() -> None:
    line = Line(fault("encoder.noise", 10, 50, 40.0))
    jumps = []
    for k in range(TICKS):
        line.tick()
        jumps.append(line.counts() - 3 * k)
    assert not any(jumps[:10]) and not any(jumps[50:])
    assert max(map(abs, jumps)) <= 40 and len(set(jumps[10:50])) > 20


def test_open_input_reads_its_rail_and_the_other_input_does_not() -> None:
    line = Line(fault("adc.open", 0, 5, channel=1))
    line.board[0]["ai_codes"] = 100
    line.tick()
    assert line.rx[0]["ai_codes"][:3].tolist() == [100, 2047, 100]


@pytest.mark.parametrize(("polarity", "bits", "rail"), [("bipolar", 12, 2047), ("unipolar", 16, 32767)])
def test_rail_of_an_open_input_is_that_of_its_converter(polarity: str, bits: int, rail: int) -> None:
    wire = AnalogInputSettings.model_validate({"channel": 0, "polarity": polarity, "bits": bits})
    blocks = [Block("input1", build_input(wire, 0.01), None)]
    made = faults.build(faults.FaultSettings(fault="adc.open"), 0.01, 0, blocks)
    line = Line(made)
    line.tick()
    assert line.rx[0]["ai_codes"][0] == rail


# outputs


@given(codes=st.integers(-2048, 2047), bit=st.integers(0, 11))
@settings(deadline=None)
def test_stuck_output_bit_is_always_one(codes: int, bit: int) -> None:
    line = Line(fault("dac.stuck", 0, 5, bit))
    wire, *others = line.tick(codes=codes)[2]
    assert (wire + 2048) >> bit & 1 and -2048 <= wire <= 2047 and others == [codes] * 3
    assert wire - codes in (0, 1 << bit)


def test_hot_driver_gives_zero_and_a_supply_sag_gives_a_fraction() -> None:
    assert Line(fault("driver.hot", 0, 5, channel=1)).tick(codes=700)[2] == [700, 0, 700, 700]
    sag = Line(fault("supply.sag", 0, 5, 0.1))
    assert [sag.tick(codes=c)[2][0] for c in (-2000, -100, 2000)] == [-204, -100, 204]


def board(*codes: tuple[int, int]) -> list[Block]:
    return [Block(f"output{n}", AnalogOutputParams(1.0, *both, n, 0.0, 0.0), None) for n, both in enumerate(codes)]


def test_output_fault_uses_the_code_range_of_each_output() -> None:
    blocks = board((-32768, 32767), (0, 4095))
    made = faults.build(faults.FaultSettings(fault="supply.sag", size=0.5), 0.001, 0, blocks)
    assert Line(made).tick(codes=30000)[2] == [16384, 2048, 1024, 1024]
    for channel, bit, right in ((0, 14, 16384), (1, 11, 2048)):
        wanted = faults.FaultSettings(fault="dac.stuck", channel=channel, size=bit)
        line = Line(made := faults.build(wanted, 0.001, 0, blocks))
        assert line.tick(codes=0)[2][channel] == right
        assert faults.in_force(line.c[0]) == [made]


def test_stuck_bit_beyond_the_output_is_refused_and_the_default_bit_exists() -> None:
    blocks = board((-128, 127))
    assert faults.build(faults.FaultSettings(fault="dac.stuck"), 0.001, 0, blocks).size == 7.0
    with pytest.raises(ValueError, match="output 0 has no bit 8; it has 0 to 7"):
        faults.build(faults.FaultSettings(fault="dac.stuck", size=8), 0.001, 0, blocks)


def test_lateness_is_the_largest_of_the_active_stalls() -> None:
    line = Line(fault("loop.stall", 5, 9, 1e-3), fault("loop.stall", 7, 8, 4e-3))
    assert [faults.lateness(line.c[0], k) for k in range(4, 10)] == [0, 10**6, 10**6, 4 * 10**6, 10**6, 0]


# settings


def test_fault_times_become_ticks_and_process_faults_take_no_slot() -> None:
    made = faults.FaultSettings(fault="link.delay", at=1.0, lasts=0.0001, size=0.02)
    assert faults.build(made, 0.002, 10) == faults.Fault(faults.LINK_DELAY, 0, 510, 511, 10.0)
    command = np.zeros(1, mailbox.COMMAND)[0]
    faults.fill(command, [faults.build(faults.FaultSettings(fault="cpu.hog"), 0.002)])
    assert command["faulty"] == 0
    with pytest.raises(ValueError, match="16 is the most"):
        faults.fill(command, [fault("link.silent", 0, 1)] * 17)


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"fault": "encoder.freeze", "channel": 12}, "no channel 12"),
        ({"fault": "encoder.freeze", "size": 1.0}, "has no size"),
        ({"fault": "link.loss", "size": 1.5}, "0 to 1 is possible"),
        ({"fault": "nothing"}, "encoder.freeze"),
    ],
)
def test_invalid_fault_is_refused(wanted: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        faults.FaultSettings.model_validate(wanted)


def test_delay_longer_than_the_delay_line_is_refused() -> None:
    with pytest.raises(ValueError, match="1023 is the most"):
        faults.build(faults.FaultSettings(fault="link.delay", size=1.0), 1e-4)


# a whole machine


def rows(mode: str, wanted: list[dict[str, Any]], seconds: float = 2.0) -> np.ndarray:
    stand = STANDS["ivu"]
    ticks = stand.ticks(seconds)
    with Inside(stand.config(wanted, loop__mode=mode), ticks) as drive:
        drive.to(ticks)
        return drive.rows().copy()


@pytest.fixture(scope="module")
def clean() -> np.ndarray:
    return rows("fused", [])


ALL = [
    {"fault": case.fault, "at": 0.5 + 0.1 * n, "lasts": 0.09, **({} if case.size is None else {"size": case.size})}
    for n, case in enumerate(COMMON)
]


def test_run_with_all_faults_is_bit_exact_in_fused_and_lockstep(clean: np.ndarray) -> None:
    fused, lockstep = rows("fused", ALL), rows("lockstep", ALL)
    assert all(np.array_equal(fused[n], lockstep[n], equal_nan=True) for n in fused.dtype.names)
    assert any(not np.array_equal(fused[n], clean[n], equal_nan=True) for n in fused.dtype.names)


@pytest.mark.parametrize("wanted", [[{"fault": "link.silent", "at": 1e6}], [{"fault": "cpu.hog", "at": 0.1}]])
def test_faults_that_never_start_do_not_change_the_run(clean: np.ndarray, wanted: list[dict[str, Any]]) -> None:
    with_fault = rows("fused", wanted)
    assert all(np.array_equal(with_fault[n], clean[n], equal_nan=True) for n in clean.dtype.names)


def test_frames_have_the_number_of_channels_of_the_catalogue(config: Callable[..., Any]) -> None:
    assert faults.KINDS["encoder.freeze"].channels == frames.COUNTERS
    assert set(faults.PROCESSES) == {n for n, kind in faults.KINDS.items() if kind.number == 0}
