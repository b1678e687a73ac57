"""A board at the end of a bus or a line, whose compiled reads and writes return -errno where they fail."""

import os

from rtctl.drivers.board import Board, BoardError


class BusBoard(Board):
    """What boards on a CAN bus and on a serial line have in common."""

    REASONS: dict[int, str] = {}  # noqa: RUF012 -- errno to what it means on this kind of bus

    def _sent(self, result: int, what: str) -> None:
        """Raise BoardError where something could not be sent."""
        if result < 0:
            raise BoardError(f"{self.name}: {what} could not be sent: {self._why(-result)}")

    def _received(self, result: int) -> None:
        """Raise BoardError where the bus could not be read."""
        if result < 0:
            raise BoardError(f"{self.name}: nothing can be received: {self._why(-result)}")

    def _why(self, code: int) -> str:
        return self.REASONS.get(code) or os.strerror(code)
