"""Injected faults between the loop and its machine: effects of a bad cable, a broken encoder or a hot amplifier.

Faults change frames after their receipt and before they are sent. So they act equally on a real board, an emulator over
a link, and an emulator inside the process. A recording holds the faulty readings; the truth columns stay unchanged.
Without faults the cost is one comparison a tick.

A fault lasts from tick `begin` to before tick `end`. Missed counts stay missed after the end.

The catalogue includes faults of processes (`PROCESSES`); the supervisor carries them out (rtctl/daemon/faults.py).
"""

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from rtctl import counted
from rtctl.drivers import daq_stc
from rtctl.drivers.at_mio_16de import AnalogInputParams, AnalogOutputParams
from rtctl.idiom import Settings, quantity, state, tick
from rtctl.tick import frames

SLOTS = 16  # most faults at the same time
DEPTH = 1024  # ticks in the delay line of a link
FOR_EVER = 2**62  # end tick of a fault without end
CODES = 2048  # codes to either side of zero of a bipolar 12-bit converter
BITS = 32  # bits of the widest converter in a frame

(
    NONE, LINK_DELAY, LINK_LOSS, LINK_REORDER, LINK_SILENT, ENCODER_FREEZE, ENCODER_MISSED, ENCODER_NOISE, ADC_OPEN,
    DAC_STUCK, DRIVER_HOT, SUPPLY_SAG, LOOP_STALL,
) = range(13)  # fmt: skip


class Kind(NamedTuple):
    """Kind of a fault: number in the tick, description, and meaning of its size ("" without a size)."""

    number: int
    words: str
    size: str = ""
    unit: str = ""
    usual: float = 0.0
    low: float = 0.0
    high: float = 0.0
    channels: int = 1


KINDS: dict[str, Kind] = {
    "link.delay": Kind(LINK_DELAY, "frames arrive late, both ways", "how late", "s", 4e-3, 0.0, 2.0),
    "link.loss": Kind(LINK_LOSS, "frames are lost at random, both ways", "share lost", "", 0.3, 0.0, 1.0),
    "link.reorder": Kind(
        LINK_REORDER, "frames are overtaken by the next one; the newest wins", "share overtaken", "", 0.3, 0.0, 1.0
    ),
    "link.silent": Kind(LINK_SILENT, "no frame arrives in either direction, as with a dead plant or a pulled cable"),
    "encoder.freeze": Kind(
        ENCODER_FREEZE, "the counter stops; the counts of the meantime are lost", channels=frames.COUNTERS
    ),
    "encoder.missed": Kind(
        ENCODER_MISSED, "a share of the counts is missed, and stays missed", "share", "", 0.1, 0.0, 1.0, frames.COUNTERS
    ),
    "encoder.noise": Kind(
        ENCODER_NOISE, "the count jumps at random", "largest jump", "counts", 200.0, 1.0, 1e6, frames.COUNTERS
    ),
    "adc.open": Kind(ADC_OPEN, "an analog input is open and drifts to its top reading", channels=frames.AI_CHANNELS),
    "dac.stuck": Kind(
        DAC_STUCK, "a bit of an analog output stays one", "which bit", "", 9.0, 0.0, BITS - 2.0,
        frames.AO_CHANNELS,
    ),
    "driver.hot": Kind(
        DRIVER_HOT, "an amplifier is too hot and has switched itself off", channels=frames.AO_CHANNELS
    ),
    "supply.sag": Kind(
        SUPPLY_SAG, "the supply sags: no output gives more than a share of its full scale", "share left", "", 0.02,
        0.0, 1.0,
    ),
    "loop.stall": Kind(LOOP_STALL, "the loop wakes late, as on a busy or suspended computer", "how late", "s",
                       1e-3, 0.0, 10.0),
    "plant.kill": Kind(NONE, "the process of the emulator is killed; a new one starts when the fault ends"),
    "supervisor.kill": Kind(NONE, "the supervisor is killed"),
    "recorder.stall": Kind(NONE, "the recorder stops, as on a disk that does not answer"),
    "disk.full": Kind(NONE, "the disk is full: from then on no rows are recorded"),
    "clock.step": Kind(
        NONE, "the wall clock of the supervisor is set to another time", "by how much", "s", 3600.0, -1e9, 1e9
    ),
    "cpu.hog": Kind(NONE, "busy processes of normal priority on all CPUs", "how many", "", 4.0, 1.0, 256.0),
}  # fmt: skip
PROCESSES = tuple(name for name, kind in KINDS.items() if kind.number == NONE)


class FaultSettings(Settings):
    """Settings of one fault. Times count from the start of the loop."""

    fault: Literal[*KINDS] = Field(description="which; `rtctl fault list` explains each")  # type: ignore[valid-type]
    at: float = quantity(0.0, unit="s", ge=0, help="when it begins")
    lasts: float | None = quantity(None, unit="s", gt=0, help="how long it lasts; for good if absent")
    channel: int = quantity(0, unit="", ge=0, help="counter, analog input or output, from 0")
    size: float | None = quantity(None, unit="", help="see `rtctl fault list`; a usual one if absent")

    @model_validator(mode="after")
    def _fits(self) -> "FaultSettings":
        kind = KINDS[self.fault]
        if self.size is not None and not kind.size:
            raise ValueError(f"{self.fault} has no size")
        if self.size is not None and not kind.low <= self.size <= kind.high:
            raise ValueError(
                f"size of {self.fault} ({kind.size}) is {self.size:g}; {kind.low:g} to {kind.high:g} is possible"
            )
        if not self.channel < kind.channels:
            raise ValueError(f"{self.fault} has no channel {self.channel}; it has 0 to {kind.channels - 1}")
        return self


class Fault(NamedTuple):
    kind: int
    channel: int
    begin: int  # ticks
    end: int
    size: float  # link.delay in ticks, loop.stall in s, adc.open as a code
    lowest: tuple[int, ...] = (-CODES,) * frames.AO_CHANNELS  # code of each analog output
    highest: tuple[int, ...] = (CODES - 1,) * frames.AO_CHANNELS


FAULT = np.dtype(
    [
        ("kind", "i8"), ("channel", "i8"), ("begin", "i8"), ("end", "i8"), ("size", "f8"),
        ("lowest", "i8", (frames.AO_CHANNELS,)), ("highest", "i8", (frames.AO_CHANNELS,)),
    ],
    align=True,
)  # fmt: skip
FAULTS_STATE = state(
    seed=int,
    raw=frames.INPUTS,  # newest frame that the board has sent
    last=frames.INPUTS,  # newest frame that the loop has got
    past=(frames.INPUTS, DEPTH),  # delay line of received frames
    came=(int, DEPTH),  # number of new frames in each tick
    gone=(frames.OUTPUTS, DEPTH),  # delay line of outputs
    known=int,  # 1 from the first tick with faults on
    since=int,  # first tick with faults
    before=(int, frames.COUNTERS),  # counts of the previous tick
    missed=(float, frames.COUNTERS),  # counts missed so far
    overtaken=int,  # 1 while a frame waits for the next one
)


def build(settings: FaultSettings, dt: float, now: int = 0, blocks: Sequence[Any] = ()) -> Fault:
    """Fault in ticks of `dt` s, counted from tick `now`; the diagram's `blocks` give the converters.

    Raises ValueError for a delay longer than the delay line, and for a bit that an output does not have.
    """
    kind = KINDS[settings.fault]
    size = kind.usual if settings.size is None else settings.size
    if settings.fault == "link.delay":
        size = float(round(size / dt))
        if size >= DEPTH:
            raise ValueError(f"link.delay: {size * dt:g} s is {size:.0f} ticks; {DEPTH - 1} is the most")
    begin = now + round(settings.at / dt)
    end = FOR_EVER if settings.lasts is None else begin + max(round(settings.lasts / dt), 1)
    if settings.fault == "adc.open":
        size = float(_rail(settings.channel, blocks))
    made = Fault(kind.number, settings.channel, begin, end, size, *_codes(blocks))
    if settings.fault == "dac.stuck":
        bits = bits_of(made)
        if settings.size is None:
            made = made._replace(size=min(size, bits - 1.0))
        elif not size < bits:
            raise ValueError(f"dac.stuck: output {made.channel} has no bit {size:g}; it has 0 to {bits - 1}")
    return made


def bits_of(fault: Fault) -> int:
    """Number of bits of the analog output of a fault."""
    return (fault.highest[fault.channel] - fault.lowest[fault.channel]).bit_length()


def _rail(channel: int, blocks: Sequence[Any]) -> int:
    """Code at the positive rail of an open analog input: half of its converter's codes; 12 bits if unknown."""
    inputs = [b.params for b in blocks if isinstance(b.params, AnalogInputParams)]
    if channel >= len(inputs):
        return CODES - 1
    return (inputs[channel].code_max - inputs[channel].code_min + 1) // 2 - 1


def _codes(blocks: Sequence[Any]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Lowest and highest code of each analog output, in the order of the frame and the diagram."""
    outputs = [b.params for b in blocks if isinstance(b.params, AnalogOutputParams)]
    usual = [(-CODES, CODES - 1)] * (frames.AO_CHANNELS - len(outputs))
    lowest, highest = zip(*((p.code_min, p.code_max) for p in outputs), *usual, strict=True)
    return lowest, highest


def fill(command: Any, wanted: Sequence[Fault]) -> None:
    """Write the faults of a run into its command record, without faults of processes. Raises ValueError for too many.

    After a first fault one slot stays in use, so that missed counts stay missed.
    """
    wanted = [fault for fault in wanted if fault.kind != NONE]
    if len(wanted) > SLOTS:
        raise ValueError(f"{len(wanted)} faults; {SLOTS} is the most at a time")
    slots = max(len(wanted), min(int(command["faulty"]), 1))
    command["faults"] = 0
    command["faults"]["lowest"], command["faults"]["highest"] = -CODES, CODES - 1  # for older recordings
    for j, fault in enumerate(wanted):
        command["faults"][j] = fault
    command["faulty"] = slots


def in_force(command: Any) -> list[Fault]:
    """The faults in a command record, including those that have ended."""
    rows = command["faults"][: int(command["faulty"])]
    faults = [
        Fault(int(r["kind"]), int(r["channel"]), int(r["begin"]), int(r["end"]), float(r["size"]),
              tuple(r["lowest"].tolist()), tuple(r["highest"].tolist()))
        for r in rows
    ]  # fmt: skip
    return [fault for fault in faults if fault.kind != NONE]


@tick
def active(fault, k):
    """Whether a fault is active in tick `k`."""
    return fault.begin <= k and k < fault.end


@tick
def chance(f, slot, k):
    """Uniform random number in (0, 1), determined by seed, slot and tick."""
    return counted.uniform(counted.nth(f.seed * SLOTS + slot, k))


@tick
def lateness(c, k):
    """Injected lateness of tick `k`, ns."""
    most = 0.0
    for j in range(c.faulty):
        if c.faults[j].kind == LOOP_STALL and active(c.faults[j], k):
            most = max(most, c.faults[j].size)
    return int(most * 1e9)


@tick
def receive(c, f, rx, fresh, k):
    """Apply the faults of tick `k` to the received frame `rx` (1,). Returns the number of new frames after the faults.

    `fresh` is the number of new frames before.
    """
    if fresh > 0 or f.known == 0:
        f.raw = rx[0]
    if f.known == 0:
        f.known, f.since, f.last = 1, k, f.raw
        assign(f.before, f.raw.counter_codes)
    rx[0] = f.raw
    misread(c, f, rx[0], k)
    f.past[k % DEPTH] = rx[0]
    f.came[k % DEPTH] = fresh
    fresh = link_in(c, f, rx, k)
    assign(rx[0].truth, f.raw.truth)
    return fresh


@tick
def link_in(c, f, rx, k):
    """Write the frame that arrives in tick `k` (new, delayed or last) to `rx` (1,). Returns the count of new frames."""
    late, lost = 0, False
    begun = f.since
    came = f.overtaken
    f.overtaken = 0
    for j in range(c.faulty):
        fault = c.faults[j]
        if not active(fault, k):
            continue
        if fault.kind == LINK_DELAY and int(fault.size) > late:
            late, begun = int(fault.size), max(fault.begin, f.since)
        elif fault.kind == LINK_SILENT or (fault.kind == LINK_LOSS and chance(f, j, k) < fault.size):
            lost = True
        elif fault.kind == LINK_REORDER and came == 0 and chance(f, j, k) < fault.size:
            f.overtaken = 1
    lost = lost or k - late < begun  # frames from before the delay have arrived; the first delayed one has not
    if not lost and f.overtaken == 0:
        came += f.came[(k - late) % DEPTH]
        f.last = f.past[(k - late) % DEPTH]
    elif lost:
        came = 0
        f.overtaken = 0
    rx[0] = f.last
    return came


@tick
def misread(c, f, rx, k):
    """Apply faults of encoders and analog inputs to the frame `rx` in tick `k`."""
    for n in range(frames.COUNTERS):
        share, jump = 0.0, 0
        for j in range(c.faulty):
            fault = c.faults[j]
            if fault.channel != n or not active(fault, k):
                continue
            if fault.kind == ENCODER_FREEZE:
                share = 1.0
            elif fault.kind == ENCODER_MISSED:
                share += fault.size
            elif fault.kind == ENCODER_NOISE:
                jump += int(fault.size * (2.0 * chance(f, j, k) - 1.0))
        f.missed[n] += min(share, 1.0) * daq_stc.difference(rx.counter_codes[n], f.before[n])
        f.before[n] = rx.counter_codes[n]
        rx.counter_codes[n] = daq_stc.wrapped(rx.counter_codes[n] - int(f.missed[n]) + jump)
    for j in range(c.faulty):
        if c.faults[j].kind == ADC_OPEN and active(c.faults[j], k):
            size = int(c.faults[j].size)
            rx.ai_codes[c.faults[j].channel] = size if size > 0 else CODES - 1  # 0 in a command of an older recording


@tick
def transmit(c, f, tx, wire, k):
    """Apply the faults of tick `k` to the outputs `tx` (1,), into `wire` (1,). Returns 1, or 0 for no frame to send."""
    if c.faulty == 0:
        put(wire[0], tx[0])
        return 1
    f.gone[k % DEPTH] = tx[0]
    late, begun = 0, 0
    for j in range(c.faulty):
        fault = c.faults[j]
        if not active(fault, k):
            continue
        if fault.kind == LINK_DELAY and int(fault.size) > late:
            late, begun = int(fault.size), max(fault.begin, f.since if f.known != 0 else k)
        elif fault.kind == LINK_SILENT or (fault.kind == LINK_LOSS and chance(f, SLOTS + j, k) < fault.size):
            return 0
    if k - late < begun:
        return 0
    put(wire[0], f.gone[(k - late) % DEPTH])
    distort(c, wire[0], k)
    return 1


@tick
def assign(to, of):
    """Copy an array. Not `to[:] = of`, whose length check takes a second to compile."""
    for i in range(len(to)):
        to[i] = of[i]


@tick
def put(wire, tx):
    """Copy the outputs from `tx` to `wire`, without the frame's number and time."""
    wire.inputs_t_ns = tx.inputs_t_ns
    assign(wire.ao_codes, tx.ao_codes)
    wire.dio_lines = tx.dio_lines
    wire.state = tx.state


@tick
def distort(c, wire, k):
    """Apply faults of converters, amplifiers and supply to the outputs `wire` in tick `k`."""
    for j in range(c.faulty):
        fault, n = c.faults[j], c.faults[j].channel
        if not active(fault, k):
            continue
        if fault.kind == DAC_STUCK:
            lowest = fault.lowest[n]
            wire.ao_codes[n] = ((wire.ao_codes[n] - lowest) | (1 << int(fault.size))) + lowest
        elif fault.kind == SUPPLY_SAG:
            for i in range(frames.AO_CHANNELS):
                most = int(fault.size * max(-fault.lowest[i], fault.highest[i] + 1))
                wire.ao_codes[i] = min(max(wire.ao_codes[i], -most), most)
        elif fault.kind == DRIVER_HOT:
            wire.ao_codes[n] = 0
