"""The plant's end of the link for a plant in Python: a real board, or an FMU.

It calls the compiled link functions of the emulator from the interpreter, so that both ends use the same code.
"""

import importlib
import time
from typing import Any

from rtctl.loop import generate

now = time.monotonic_ns  # CLOCK_MONOTONIC, as rtctl.tick.clock


def sleep_until(wake: int) -> None:
    """Sleep until `wake`, ns on the loop's clock."""
    left = wake - now()
    if left > 0:
        time.sleep(left * 1e-9)


class LinkEnd:
    """Plant's end of a link: `tx` is the record of the newest outputs, `rx` the record of the next sample to send."""

    def __init__(self, kind: str, status: Any, out: Any, inp: Any) -> None:
        self._link = importlib.import_module(f"rtctl.loop.{kind}_link")
        self._status, self._to, self._from = status, out, inp
        frames = generate.new_frames()
        self._tx, self._staged, self._rx = frames["tx"], frames["tx_staged"], frames["rx"]
        self.tx, self.rx = self._tx[0], self._rx[0]
        self._link.receive_newest(inp, self._tx, self._staged)  # compile before the real-time run

    def newest(self) -> bool:
        """Take the newest outputs without waiting. Returns whether they are new."""
        fresh = self._link.receive_newest(self._from, self._tx, self._staged) > 0
        self._status["frames"][0] += int(fresh)
        return bool(fresh)

    def wait(self) -> bool:
        """Wait for new outputs, at most for the link's time-out. Returns whether outputs came."""
        fresh = self._link.receive(self._from, self._tx, self._staged) == 1
        self._status["frames"][0] += int(fresh)
        return bool(fresh)

    def answer(self) -> None:
        """Send the sample with its number, its time, and the number and time of the outputs before it."""
        rx, tx = self.rx, self.tx
        rx["seq"] += 1
        rx["t_ns"] = now()
        rx["outputs_seq"], rx["outputs_t_ns"] = tx["seq"], tx["t_ns"]
        self._link.send(self._to, self._rx)
        self._status["tick"][0] += 1
        self._status["ready"][0] = 1

    @property
    def stopped(self) -> bool:
        return bool(self._status["stop"][0])
