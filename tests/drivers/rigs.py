"""Rigs: each kind of board with the same emulated wires."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.drivers.board import Board, Wiring
from rtctl.drivers.comedi import ComediCard, ComediSettings
from rtctl.drivers.emulated import EmulatedCard
from rtctl.drivers.nidaq import NidaqError


class Rig(NamedTuple):
    """An unopened card and its wires."""

    card: Board
    set_input: Callable[[int, float], None]  # channel, V
    pulse: Callable[[int, int], None]  # counter, signed pulses
    output: Callable[[int], float]  # V at a channel
    line: Callable[[int], int]
    fail: Callable[[str], None]  # makes "inputs", "counters", "outputs" or "lines" fail
    step: float  # V, resolution of the inputs
    end: Callable[[], None] = lambda: None  # closes the emulated device


def emulated(wiring: Wiring) -> Rig:
    card = EmulatedCard(wiring)
    board = card.card

    def pulse(counter: int, pulses: int) -> None:
        board.dio[6 + counter] = int(pulses > 0)
        board.pulse(counter, abs(pulses))

    def fail(what: str) -> None:
        def broken(*_: Any) -> Any:
            raise NidaqError("badDeviceError", "pulled out")

        name = {"inputs": "AI_VRead_Scan", "counters": "GPCTR_Watch", "outputs": "AO_VWrite"}[what]
        setattr(board, name, broken)

    return Rig(
        card, lambda c, v: board.input_volts.__setitem__(c, v), pulse, board.output_volts, lambda n: board.dio[n], fail,
        10 / 4096,
    )  # fmt: skip


def comedi(wiring: Wiring, library: Path, number: int = 0, **settings: Any) -> Rig:
    """Card 0 is an AT-MIO-16DE-10, card 1 one of 16 bits."""
    lib = ctypes.CDLL(str(library))
    lib.wire_output.restype = ctypes.c_double
    lib.wire_input.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_double]
    lib.wire_reset(number)
    device = ("/dev/comedi0", "/dev/comedi4")[number]
    card = ComediCard(ComediSettings(library=str(library), device=device, **settings), wiring)
    kinds = {"inputs": (1, 1), "counters": (6, 0), "outputs": (2, 0), "lines": (5, 0)}
    return Rig(
        card,
        lambda c, v: lib.wire_input(number, c, v),
        lambda n, pulses: lib.wire_pulses(number, n, pulses),
        lambda c: lib.wire_output(number, c),
        lambda n: lib.wire_lines(number) >> n & 1,
        lambda what: lib.wire_fail(*kinds[what]),
        10 / 4096 if number == 0 else 10 / 65536,
    )


def daqmx(wiring: Wiring, patch: Any, **settings: Any) -> Rig:
    from daqmx_card import STEP, Daqmx
    from nidaqmx import utils

    from rtctl.drivers.nidaqmx import NidaqmxCard, NidaqmxSettings

    below = Daqmx()
    patch.setattr(utils, "_select_interpreter", lambda *_: below)
    card = NidaqmxCard(NidaqmxSettings(**settings), wiring, 500.0)

    def fail(what: str) -> None:
        below.fails = what

    return Rig(
        card, lambda c, v: below.volts.__setitem__(c, v), below.pulses, lambda c: below.out[c],
        lambda n: below.lines >> n & 1, fail, STEP,
    )  # fmt: skip


def can(wiring: Wiring, **settings: Any) -> Rig:
    """Two nodes on a bus: torque in Nm for volts, position in turns of 8192 counts, current in A for volts."""
    from odrive_nodes import Nodes, pair

    from rtctl.drivers.can import CanBoard, CanSettings

    ours, theirs = pair()
    ids = [1 + o.channel for o in wiring.outputs]
    wiring = wiring._replace(
        lines=(),
        drives=tuple(f"output {o.channel}" for o in wiring.outputs),
        sensors=(*(f"counter {n}" for n in range(wiring.counters)), *(f"input {i.channel}" for i in wiring.inputs)),
        measures=("position",) * wiring.counters + ("current",) * len(wiring.inputs),
        turns=(8192.0,) * wiring.counters + (None,) * len(wiring.inputs),
    )
    of = [ids[n] for n in range(wiring.counters)] + [1 + i.channel for i in wiring.inputs]
    given = {
        "nodes": {name: {"id": node} for name, node in zip(wiring.drives, ids, strict=True)},
        "sensors": {name: {"id": node} for name, node in zip(wiring.sensors, of, strict=True)},
        "timeout": 0.5,  # s, for a busy machine
        **settings,
    }
    nodes = Nodes(theirs, *sorted({*ids, *of}))
    card = CanBoard(CanSettings.model_validate(given), wiring, 2.0, ours)  # an answer may take 0.25 s

    def pulse(counter: int, pulses: int) -> None:
        nodes.nodes[of[counter]].position += pulses / 8192

    def fail(what: str) -> None:
        if what == "inputs":
            for node in nodes.nodes.values():
                node.short.add(0x14)
        elif what == "counters":
            nodes.nodes[ids[0]].error = 0x20
            nodes.heartbeat(ids[0])
        else:
            nodes.close()

    rig = Rig(
        card,
        lambda c, v: setattr(nodes.nodes[1 + c], "current", v),
        pulse,
        lambda c: nodes[1 + c].torque,
        lambda n: 0,
        fail,
        2e-6,
        lambda: (nodes.close(), ours.close()),  # type: ignore[arg-type, return-value]
    )
    card.nodes = nodes  # type: ignore[attr-defined]  # for tests of its own
    return rig


def serial(wiring: Wiring, lib: Any, **settings: Any) -> Rig:
    """A microcontroller whose floats are volts."""
    from serial_device import Device

    from rtctl.drivers.serial import SerialBoard, SerialSettings

    device = Device(lib, len(wiring.outputs), len(wiring.inputs), wiring.counters, wiring.mask)
    card = SerialBoard(SerialSettings(**{"port": device.port, "timeout": 0.5, **settings}), wiring, 2.0)
    place = {o.channel: n for n, o in enumerate(wiring.outputs)}
    seen = {i.channel: n for n, i in enumerate(wiring.inputs)}

    # a sample is of when the outputs that it answers came: what changes afterwards shows in the next

    def set_input(channel: int, volts: float) -> None:
        device.board.input[seen[channel]] = volts
        card.unread = False

    def pulse(counter: int, pulses: int) -> None:
        card.unread = False
        device.board.counter[counter] = (device.board.counter[counter] + pulses) & 0xFFFFFFFF

    def fail(what: str) -> None:
        if what == "outputs":
            device.unplug()
        else:
            device.board.fault, card.unread = 7, False

    def told() -> Any:
        return device.told(int(card._line["number"]))

    rig = Rig(
        card,
        set_input,
        pulse,
        lambda c: float(told().output[place[c]]),
        lambda n: told().lines_out >> n & 1,
        fail,
        2e-6,
        device.close,
    )
    card.device = device  # type: ignore[attr-defined]
    return rig
