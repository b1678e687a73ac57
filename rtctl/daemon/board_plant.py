"""A real board in place of the emulator: outputs from the loop to the card, samples from the card to the loop.

The board has a process of its own at the plant's end of the link (decision 0009), so it outlives the loop. When the
loop dies, hangs or is cut off, this process sets the outputs to zero.
"""

import gc
from typing import Any

from rtctl.daemon.link_end import LinkEnd, now, sleep_until
from rtctl.drivers.board import Board
from rtctl.drivers.boards import make
from rtctl.loop.realtime import RealTime
from rtctl.machines import Machine
from rtctl.machines.wiring import wiring
from rtctl.tick import safety


class BoardPlant:
    """A card that serves a loop. Raises UserError where the card cannot be opened."""

    def __init__(
        self, machine: Machine, link: str, status: Any, out: Any, inp: Any, board: Board | None = None
    ) -> None:
        config = machine.config
        rate = config.driver.rate or 1.0 / machine.plant_period
        self.board = board or make(config.driver, wiring(config), rate)
        self._period, self._hold = round(1e9 / rate), round(config.safety.link_timeout * 1e9)
        self._priority = 0 if config.loop.realtime == "off" else max(config.loop.priority - 1, 1)  # below the loop's
        self._status = status
        self.end = LinkEnd(link, status, out, inp)
        self._codes = [0] * len(self.board.outputs)
        self._on = False  # whether the drives have power
        self.board.open()

    def run(self) -> None:
        """Serve on the wall clock until status.stop is set; the outputs are zero afterwards, whatever happened.

        Raises BoardError where the card fails; the loop then gets no samples, and trips.
        """
        real_time = None
        try:
            real_time = RealTime(self._priority, None) if self._priority else None
            gc.disable()  # no pauses; a turn makes no reference cycles
            wake = now() + self._period
            while not self.end.stopped:
                sleep_until(wake)
                self.turn()
                behind = (now() - wake) // self._period
                self._status["skipped"][0] += behind  # a missed sample is skipped, not repeated
                wake += (1 + behind) * self._period
        finally:
            self.board.close()
            self._status["ended"][0] = 1
            gc.enable()
            if real_time is not None:
                real_time.close()

    def turn(self) -> None:
        """Write the newest outputs to the card, and send a sample to the loop."""
        self.end.newest()
        codes, lines = self.due()
        state = self.end.tx["state"]  # as `due` left it
        on = bool(state in (safety.ARMED, safety.RUNNING) or (state == safety.TRIPPED and any(codes)))
        if on != self._on:
            self._on = on
            self.board.enable(on)
        self.board.write(codes, lines)
        self._codes = codes
        self.board.read(self.end.rx)
        self.end.answer()

    def due(self) -> tuple[list[int], int]:
        """DAC codes (outputs,) and digital lines that may be written now.

        They are zero while the machine is off. They are zero, too, if the sample that the newest outputs answer is
        older than the link's time-out, by this process's clock. After a trip no output grows, whatever the frame says.
        """
        tx = self.end.tx
        off = [0] * len(self._codes)
        if tx["state"] != safety.IDLE and now() - int(tx["inputs_t_ns"]) > self._hold:
            if tx["state"] in (safety.ARMED, safety.RUNNING):
                self._watchdog()
            tx["state"] = safety.IDLE
        if tx["state"] == safety.IDLE:
            return off, 0
        codes = [int(c) for c in tx["ao_codes"][: len(off)]]
        if tx["state"] == safety.TRIPPED:
            codes = [c if abs(c) <= abs(was) and c * was >= 0 else 0 for c, was in zip(codes, self._codes, strict=True)]
        return codes, int(tx["dio_lines"])

    def _watchdog(self) -> None:
        """Count a time-out of the outputs while they were on, and report it to the loop with the next sample."""
        self._status["watchdog"][0] += 1
        self.end.rx["watchdog"] += 1
        self.end.rx["watchdog_seq"] = self.end.tx["seq"]


def zero(config: Any) -> str | None:
    """Set the outputs of a card to zero after its process has died. Returns the error as text, None if none."""
    try:
        make(config.driver, wiring(config), config.loop.rate).open().close()
    except Exception as error:
        return str(error)
    return None
