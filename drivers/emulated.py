"""Board of the emulated AT-MIO-16DE-10, through the NI-DAQ calls of the thesis.

It is the reference for the real cards: one test suite runs on all boards.

Source: thesis appendix D (ATMIO16DE.tlc).
"""

from collections.abc import Callable, Sequence
from typing import Any

from rtctl.drivers import daq_stc, nidaq
from rtctl.drivers.board import Board, BoardError, Wiring

COUNTERS = (nidaq.ND_COUNTER_0, nidaq.ND_COUNTER_1)
DEVICE = 1


class EmulatedCard(Board):
    """Board on the emulated card `card`, a `nidaq.EmulatedBoard`."""

    def __init__(self, wiring: Wiring, card: nidaq.EmulatedBoard | None = None, dither: bool = False) -> None:
        super().__init__(wiring)
        bits = max(channel.bits for channel in (*wiring.outputs, *wiring.inputs))
        self.card = card or nidaq.EmulatedBoard(DEVICE, bits=bits)
        self._dither = dither

    @property
    def name(self) -> str:
        return "emulated at-mio-16de-10"

    def _open(self) -> None:
        card, w = self.card, self.wiring
        card.Init_DA_Brds(DEVICE)
        card.MIO_Config(DEVICE, int(self._dither), 0)
        for i in w.inputs:
            mode, polarity = nidaq.MODES.index(i.mode), nidaq.POLARITIES.index(i.polarity)
            card.AI_Configure(DEVICE, i.channel, mode, 0, polarity, 0)
        if w.inputs:
            gains = [-1 if i.gain == 0.5 else i.gain for i in w.inputs]
            card.SCAN_Setup(DEVICE, len(w.inputs), [i.channel for i in w.inputs], gains)
        for o in w.outputs:
            external = o.reference == "external"
            card.AO_Configure(
                DEVICE, o.channel, nidaq.POLARITIES.index(o.polarity), int(external), o.external_volts or 10.0, 0
            )
        for counter in COUNTERS[: w.counters]:
            card.GPCTR_Control(DEVICE, counter, nidaq.ND_RESET)
            card.GPCTR_Set_Application(DEVICE, counter, nidaq.ND_SIMPLE_EVENT_CNT)
            card.GPCTR_Change_Parameter(DEVICE, counter, nidaq.ND_UP_DOWN, nidaq.ND_HARDWARE)
            card.GPCTR_Change_Parameter(DEVICE, counter, nidaq.ND_INITIAL_COUNT, daq_stc.INITIAL_COUNT)
            card.GPCTR_Control(DEVICE, counter, nidaq.ND_PROGRAM)

    def _read_volts(self) -> Sequence[float]:
        return self._call(lambda: self.card.AI_VRead_Scan(DEVICE))

    def _read_counts(self) -> Sequence[int]:
        used = COUNTERS[: self.wiring.counters]
        return self._call(lambda: [self.card.GPCTR_Watch(DEVICE, c, nidaq.ND_COUNT) for c in used])

    def _write_code(self, n: int, code: int) -> None:
        volts = code * self.outputs[n].volts_per_code
        self._call(lambda: self.card.AO_VWrite(DEVICE, self.wiring.outputs[n].channel, volts))

    def _write_lines(self, bits: int) -> None:
        for line in self.wiring.lines:
            self.card.dio[line] = bits >> line & 1

    def _close(self) -> None:
        pass

    def _call(self, call: Callable[[], Any]) -> Any:
        try:
            return call()
        except nidaq.NidaqError as error:
            raise BoardError(f"{self.name}: {error}") from error
