"""Base class of boards on a bus or a serial line, whose compiled reads and writes return -errno on failure."""

import os

from rtctl.drivers.board import Board, BoardError


class BusBoard(Board):
    """Common part of boards on a CAN bus and on a serial line."""

    REASONS: dict[int, str] = {}  # noqa: RUF012 -- errno -> its meaning on this kind of bus

    def _sent(self, result: int, what: str) -> None:
        """Raise BoardError if `result` of a write is negative."""
        if result < 0:
            raise BoardError(f"{self.name}: {what} could not be sent: {self._why(-result)}")

    def _received(self, result: int) -> None:
        """Raise BoardError if `result` of a read is negative."""
        if result < 0:
            raise BoardError(f"{self.name}: nothing can be received: {self._why(-result)}")

    def _why(self, code: int) -> str:
        return self.REASONS.get(code) or os.strerror(code)
