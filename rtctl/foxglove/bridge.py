"""Bridge from a running machine to Foxglove: reads the ring and the command socket, and serves a WebSocket."""

import time
from types import TracebackType
from typing import Any

import foxglove
import numpy as np
from foxglove.websocket import Capability

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client, listens
from rtctl.daemon.tap import Tap
from rtctl.foxglove.channels import ERROR, INFO, WARNING, Channels
from rtctl.foxglove.envelope import Envelope
from rtctl.foxglove.parameters import SETPOINT, Parameters
from rtctl.machines.base import Column
from rtctl.tick import safety

TURN = 0.02  # s between two reads of the ring
STATUS = 0.25  # s between two requests of the status
SETTINGS = 1.0  # s between two requests of the settings
LOOK = 0.25  # s between two connection attempts to a daemon that has ended
WATCHED = ("state", "trip", "order")  # columns whose changes are events
BACKLOG = 4096  # most queued messages for a slow viewer; then the oldest are dropped


class Bridge:
    """Foxglove server for the machine of `client`; `turn` sends new data once, `run` until an exception.

    At most `rate` rows a second are sent, with the extremes of the rows left out; None sends every row. Raises
    UserError where the ring cannot be read or the port is in use.
    """

    def __init__(self, client: Client, host: str, port: int, rate: float | None, control: bool):
        self._client, self._rate = client, rate
        self._context = foxglove.Context()
        self._channels: Channels | None = None
        self._begin()
        self._parameters = Parameters(Client(client.endpoint, client.timeout, client.curve), control)
        self._values = self._parameters.values()
        try:
            self._server: Any = foxglove.start_server(
                name=f"rtctl {self._status['name']}", host=host, port=port, context=self._context,
                capabilities=[Capability.Parameters], server_listener=self._parameters, message_backlog_size=BACKLOG,
                supported_encodings=["json"],
            )  # fmt: skip
        except (RuntimeError, OSError) as error:
            raise UserError(f"cannot serve at {host}:{port}: {error}; choose another --port or --host") from None
        self._parameters.server = self._server
        self.url = f"ws://{host}:{self._server.port}"
        self.gone = False

    def __enter__(self) -> "Bridge":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._server.stop()
        self._parameters.close()

    @property
    def app_url(self) -> str:
        """Address that opens this server in Foxglove's web application."""
        return str(self._server.app_url())

    def run(self) -> None:
        """Serve until an exception, such as that of Ctrl-C."""
        while True:
            time.sleep(LOOK if self.gone else TURN)
            self.turn()

    def turn(self) -> None:
        """Send new rows, status and settings. If the daemon has ended, report it and wait for its return."""
        try:
            if self.gone:
                self._return()
            else:
                self._send_rows()
                self._send_status()
                self._send_settings()
        except UserError:
            self._leave()

    def _begin(self) -> None:
        status = self._status = self._client.call("status")  # before the tap, so that no change is missed
        signals = self._client.call("signals")
        try:
            self._tap = Tap(signals["ring"])
        except OSError as error:
            raise UserError(
                f"{signals['ring']['path']}: the rows are out of reach ({error.strerror or error}); run this on the "
                "machine of the daemon and as its user, and take the port to you with `ssh -L 8765:127.0.0.1:8765`"
            ) from None
        rate = status["rate_hz"]
        self._envelope = Envelope(1 if self._rate is None else max(1, -(-int(rate) // int(self._rate))))
        if self._channels is not None:
            self._channels.close()
        self._t = status["signals"].get("t", 0.0)
        columns = [Column(s["name"], s["unit"], s["help"]) for s in signals["signals"]]
        zero = time.time_ns() - round(self._t * 1e9)
        thinned = self._envelope.every > 1
        self._channels = Channels(self._context, status["machine"], columns, status, thinned, zero)
        self._seen = {name: status["signals"].get(name, 0.0) for name in WATCHED}
        self._next_status = self._next_settings = 0.0

    def _send_rows(self) -> None:
        assert self._channels is not None
        lost = self._tap.lost
        rows = self._tap.take()
        if self._tap.lost > lost:
            self._event(f"{self._tap.lost - lost} rows were overwritten before they were read here", WARNING)
        if not len(rows):
            return
        self._send_changes(rows)
        self._t = float(rows["t"][-1])
        self._channels.rows(self._envelope.feed(rows))

    def _send_changes(self, rows: np.ndarray) -> None:
        """Send events of the rows with their ticks: states, trips, commands carried out."""
        assert self._channels is not None
        whole = {name: np.concatenate(([self._seen[name]], rows[name])) for name in WATCHED}
        self._seen = {name: float(rows[name][-1]) for name in WATCHED}
        changed = np.flatnonzero(np.any([np.diff(whole[name]) != 0 for name in WATCHED], axis=0))
        for n in changed:
            t, tick = float(rows["t"][n]), int(rows["tick"][n])
            state, trip, order = (int(rows[name][n]) for name in WATCHED)
            if trip and trip != int(whole["trip"][n]):
                code, why = safety.TRIPS[trip]
                self._channels.event(f"tick {tick}: tripped, {code}: {why}", t, self._name, ERROR)
            elif state != int(whole["state"][n]):
                self._channels.event(f"tick {tick}: {safety.STATES[state]}", t, self._name)
            if order != int(whole["order"][n]):
                self._channels.event(f"tick {tick}: order {order} taken in", t, self._name)

    def _send_status(self) -> None:
        assert self._channels is not None
        if time.monotonic() < self._next_status:
            return
        self._next_status = time.monotonic() + STATUS
        before, self._status = self._status, self._client.call("status")
        for what in ("missed", "overruns"):
            if self._status[what] > before[what]:
                self._event(f"{self._status[what] - before[what]} {what}", WARNING)
        self._channels.status(self._status, self._t)

    def _send_settings(self) -> None:
        """Send settings that any client has changed."""
        if time.monotonic() < self._next_settings:
            return
        self._next_settings = time.monotonic() + SETTINGS
        found = self._parameters.values()
        changed = {name: value for name, value in found.items() if self._values.get(name) != value}
        self._values = found
        if changed:
            self._server.publish_parameter_values([foxglove.Parameter(n, value=v) for n, v in changed.items()])
        for name, value in changed.items():
            if name == SETPOINT:
                continue  # a playing reference changes the setpoint all the time
            self._event(f"{name} is {value}", INFO)

    def _leave(self) -> None:
        self.gone = True
        text = f"{self._name} has ended, or does not answer; waiting for it"
        self._event(text, ERROR)
        self._server.publish_status(text, foxglove.StatusLevel.Error, "gone")

    def _return(self) -> None:
        if not listens(self._client.endpoint):
            return
        self._begin()
        self.gone = False
        self._server.remove_status(["gone"])
        self._event(f"{self._name} is back, pid {self._status['pid']}", INFO)

    def _event(self, text: str, level: int) -> None:
        assert self._channels is not None
        self._channels.event(text, self._t, self._name, level)

    @property
    def _name(self) -> str:
        return str(self._status["name"])
