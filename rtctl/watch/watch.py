"""Watch of a running machine: a separate process that reads its rows, judges them, and reports to the daemon.

Neither loop nor daemon waits for the watch: rows come through a tap, reports go through the command socket, the daemon
makes the captures, and a diagnosis is a process of the lowest priority.
"""

import contextlib
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.watch.background import Background, aside
from rtctl.watch.kept import identity, load_band, save_band
from rtctl.watch.monitor import LEARN, Alarm, Monitor
from rtctl.watch.report import report
from rtctl.watch.source import Source

TURN = 0.25  # s between two looks at the ring
TELL = 1.0  # s between two reports
QUIETER = 5  # niceness of this process above that of its parent
NOTES = 8  # latest notes that are kept


class Watch:
    """Watches the machine of `client` until `turn` is no longer called. `say` gets one-line messages.

    `model` is a config whose machine and physics replace the nominal model; `band` is a file with a band that was
    learned before, or a new file for the band. Raises UserError where the machine cannot be watched.
    """

    def __init__(self, client: Client, say: Callable[[str], None], model: Path | None = None, band: Path | None = None,
                 seconds: float = LEARN, out: Path | None = None, diagnose: bool = True):  # fmt: skip
        self._client, self.say = client, say
        self._model, self._band, self._seconds, self._diagnose = model, band, seconds, diagnose
        self._out = out
        self.source = Source(Client(client.endpoint, client.timeout, client.curve))
        self.source.begin()
        self.monitor = self._monitor()
        self.background: Background | None = None
        self.alarm: dict[str, Any] | None = None
        self.notes: list[str] = []
        self._told = 0.0
        self._state = ""
        self._alarms = 0
        os.nice(QUIETER)
        aside(self._cpu)

    @property
    def _cpu(self) -> int | None:
        """Processor of the loop, as the config has it; else the last one, where the daemon puts it."""
        given = self.source.case.get("config", {}).get("loop", {}).get("cpu")
        return int(given) if given is not None else max(os.sched_getaffinity(0))

    def _monitor(self) -> Monitor:
        case = self.source.case
        band = None
        if self._band is not None and self._band.exists():
            band = load_band(self._band, identity(case, self._model))
            self.say(f"the band is that of {self._band}")
        return Monitor(case, self._model, self._seconds, band)

    def run(self) -> None:
        """Watch until an exception, such as that of Ctrl-C or SIGTERM; no diagnosis outlives the watch."""
        with contextlib.suppress(ValueError):  # not in the main thread
            signal.signal(signal.SIGTERM, _interrupt)
        try:
            while True:
                self.turn()
                time.sleep(TURN)
        finally:
            if self.background is not None:
                self.background.close()

    def turn(self) -> None:
        """Process new rows, poll capture and diagnosis, and report to the daemon when a report is due."""
        taken = self.source.take()
        for note in taken.notes:
            self._note(note)
        if taken.begun:
            self._anew()
        if taken.rows is not None:
            learned = self.monitor.band
            alarm = self.monitor.feed(taken.rows, taken.lost)
            for note in self.monitor.notes:
                self._note(note)
            self.monitor.notes.clear()
            if learned is None and self.monitor.band is not None and self._band is not None:
                save_band(self._band, self.monitor.band, identity(self.source.case, self._model))
                self.say(f"the band is written to {self._band}")
            if alarm is not None:
                self._alarmed(alarm)
        self._look()
        if taken.rows is not None and time.monotonic() - self._told >= TELL:
            self.tell()

    def tell(self) -> None:
        """Report to the daemon, and print changes."""
        self._told = time.monotonic()
        state = self.monitor.state
        if state != self._state:
            self._state = state
            self.say(STATES[state])
        try:
            self._client.call("watch", **report(self.monitor, self.notes, self.alarm))
        except UserError as error:
            self.say(f"the daemon did not take the report: {error}")

    def _anew(self) -> None:
        """Continue with a restarted machine; the band stays where the model is unchanged."""
        before = self.monitor
        if identity(self.source.case, self._model) == identity(before.case, self._model):
            self.monitor = Monitor(self.source.case, self._model, self._seconds, before.band)
        else:
            self._note("the machine runs with another config, and so with another model: its band is learned anew")
            self._band = None
            self.monitor = self._monitor()
        self.alarm = None

    def _alarmed(self, alarm: Alarm) -> None:
        self._alarms += 1
        self.say(f"t = {alarm.t:.0f} s: the machine departs from its model, from {alarm.began:.0f} s on: {alarm.words}")
        if self.alarm is not None:  # the first alarm and its diagnosis are kept
            return
        self.alarm = {"t": alarm.t, "words": alarm.words}
        name = self.source.status["name"]
        stamp = time.strftime("%Y%m%d-%H%M%S")
        out = (self._out or Path("runs")) / f"{name}-alarm-{stamp}"
        self.background = Background(self._client, out, self._cpu, self._diagnose)
        if trouble := self.background.begin():
            self._note(trouble)
        else:
            self.alarm["bundle"] = str(self.background.bundle)
        self.tell()

    def _look(self) -> None:
        background = self.background
        if background is None or self.alarm is None or background.done:
            return
        if trouble := background.look():
            self._note(trouble)
        if background.diagnosis is not None and "diagnosis" not in self.alarm:
            self.alarm["diagnosis"] = background.diagnosis[:2000]
            if background.page is not None:
                self.alarm["page"] = str(background.page)
            self.say(f"diagnosis: {background.diagnosis}")
            self.say(f"page: {background.page or background.bundle}")
            self.tell()

    def _note(self, note: str) -> None:
        if not self.notes or self.notes[-1] != note:
            self.say(note)
            self.notes = [*self.notes, note][-NOTES:]


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


STATES = {
    "waiting": "waits for motion, from which the model starts",
    "learning": "learns the deviations of the healthy machine from its model; change nothing and let the machine move",
    "watching": "watches",
    "astray": "the model diverges from the rows repeatedly and cannot judge the machine; check the description of the "
    "machine with `rtctl diagnose`",
}
