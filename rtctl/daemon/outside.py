"""Sockets of a daemon for its clients: command socket, telemetry and rows, each behind a door (doors.py)."""

import time
from typing import Any

import numpy as np
import zmq

from rtctl.daemon import keys
from rtctl.daemon.commands import Commands
from rtctl.daemon.doors import COMMANDERS, VIEWERS, Doors, raise_limit
from rtctl.daemon.rows import RowsOut
from rtctl.daemon.server import CommandServer, default_endpoint, runtime_dir
from rtctl.daemon.telemetry import Telemetry

MOST_ROWS = 2000  # newest rows considered for a telemetry message


class Outside:
    """Sockets of a machine with these settings; `columns` are the names of its signals, `row` is the dtype of its rows.

    Raises UserError where an address is not available, or is open to the network without keys.
    """

    def __init__(self, config: Any, columns: list[str], row: np.dtype, commands: Commands):
        given, name = config.commands, config.name
        raise_limit()
        self._doors = Doors(runtime_dir(), name)
        self._context = zmq.Context()
        self._signals = [column for column in columns if column != "t"]
        self._period, self._latest, self._rows = given.telemetry_period, 0.0, list[np.ndarray]()
        curve = keys.server_curve() if given.keys else None
        try:
            self.server = CommandServer(
                given.endpoint or default_endpoint(name, "command"), commands, self._context, curve, commands.heard,
                self._doors.door("command", "control", COMMANDERS, replaces=True),
            )  # fmt: skip
            self._telemetry = Telemetry(
                given.telemetry or default_endpoint(name, "telemetry"), name, self._signals, self._context,
                max_rows_per_message=max(1, int(given.telemetry_rate * given.telemetry_period)), curve=curve,
                door=self._doors.door("telemetry", "viewers", VIEWERS),
            )  # fmt: skip
            self._rows_out = RowsOut(
                default_endpoint(name, "rows"), name, row, self._context, self._doors.door("rows", "viewers", VIEWERS)
            )
        except BaseException:
            self.close()
            raise

    def look(self) -> None:
        """Start door processes that are needed, and answer waiting commands."""
        self._doors.look()
        self.server.process()

    def publish(self, rows: np.ndarray) -> None:
        """Publish trace rows (n,) to the subscribers of telemetry and rows."""
        self._rows.append(rows[-MOST_ROWS:])
        now = time.monotonic()
        if now - self._latest >= self._period:
            self._latest = now
            kept = np.concatenate(self._rows)[-MOST_ROWS:]
            self._rows = []
            self._telemetry.publish(np.column_stack([kept["t"], *[kept[name] for name in self._signals]]))
        self._rows_out.publish(rows)

    def close(self) -> None:
        """Close the sockets, after pending messages."""
        for name in ("_rows_out", "_telemetry", "server"):
            if (socket := getattr(self, name, None)) is not None:
                socket.close()
        self._context.destroy(linger=100)
        self._doors.close()
