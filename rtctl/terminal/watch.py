"""`rtctl status --watch`: the panel of a running machine until Ctrl-C, also across a restart of the daemon."""

import time
from typing import Any

from rich.console import Console
from rich.live import Live

from rtctl.config.errors import UserError
from rtctl.daemon.client import listens
from rtctl.terminal.panel import Panel
from rtctl.terminal.screen import takes_pictures
from rtctl.terminal.traces import Traces
from rtctl.terminal.view import plain

LOOK = 0.25  # s between two attempts to find a daemon that has ended


class Watch:
    """Repeated display of a daemon's status; `found` is its first status."""

    def __init__(self, client: Any, found: dict[str, Any], console: Console):
        self.client, self.console = client, console
        self.found = found
        self.law: dict[str, Any] = {}
        self.traces = self._begin()
        self.gone = ""

    def run(self, every: float) -> None:
        """Show a frame each `every` s until Ctrl-C, or plain lines where the cursor cannot be moved."""
        try:
            if takes_pictures(self.console):
                self._pictures(every)
            else:
                self._lines(every)
        except KeyboardInterrupt:
            return

    def _pictures(self, every: float) -> None:
        with Live(self._panel(), console=self.console, auto_refresh=False) as live:
            while True:
                time.sleep(LOOK if self.gone else every)
                self._look()
                live.update(self._panel(), refresh=True)

    def _lines(self, every: float) -> None:
        told = ""
        while True:
            if self.gone != told:
                self._print(self.gone or f"{self.found['name']} is back (pid {self.found['pid']})")
                told = self.gone
            if not self.gone:
                self._print(plain(self.found, self.traces.units))
            time.sleep(LOOK if self.gone else every)
            self._look()

    def _print(self, line: str) -> None:
        self.console.print(line, soft_wrap=True, highlight=False, markup=False)

    def _panel(self) -> Panel:
        return Panel(self.found, self.law, self.traces, gone=self.gone)

    def _look(self) -> None:
        """Fetch a new status, or set `gone` to the reason why there is none."""
        name = self.found["name"]
        if not listens(self.client.endpoint):
            self.gone = f"{name} has ended; waiting for it to come back, Ctrl-C ends"
            return
        try:
            found = self.client.call("status")
            if self.gone or found["pid"] != self.found["pid"]:
                self.traces = self._begin()
            self.law = self.client.call("get", path="law")["value"]
        except UserError as error:
            self.gone = f"no answer from {name}: {error}"
            return
        self.found, self.gone = found, ""
        self.traces.update(found["signals"])

    def _begin(self) -> Traces:
        self.law = self.client.call("get", path="law")["value"]
        return Traces(self.client.call("signals"))
