"""The three kinds of card on a rig: the same wires, whoever drives them."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.drivers.board import Board, Wiring
from rtctl.drivers.comedi import ComediCard, ComediSettings
from rtctl.drivers.emulated import EmulatedCard
from rtctl.drivers.nidaq import NidaqError


class Rig(NamedTuple):
    """A card that is not open yet, and its wires."""

    card: Board
    set_input: Callable[[int, float], None]  # channel, V
    pulse: Callable[[int, int], None]  # counter, signed pulses
    output: Callable[[int], float]  # V at a channel
    line: Callable[[int], int]
    fail: Callable[[str], None]  # "inputs", "counters", "outputs" or "lines" do not work from now on
    step: float  # V, what the card's inputs resolve


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
