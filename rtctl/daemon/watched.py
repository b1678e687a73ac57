"""Last report of `rtctl watch`, the model beside the machine: for `status`, the log and the metrics."""

import time
from typing import Any

from rtctl.daemon.log import log

SILENT = 10.0  # s without a report, after which a watch counts as ended


class Watched:
    """The last report of a watch, as `told`; None before the first report."""

    def __init__(self) -> None:
        self._report: dict[str, Any] | None = None
        self._at = 0.0
        self._logged: tuple[Any, ...] = ()
        self._noted: list[str] = []

    def take(self, report: dict[str, Any]) -> None:
        """Keep a report; new alarms, their bundle and diagnosis, and new notes go to the log."""
        self._report, self._at = report, time.monotonic()
        alarm = report.get("alarm")
        heard = () if alarm is None else tuple(alarm.get(key) for key in ("t", "words", "bundle", "diagnosis"))
        if alarm is not None and heard != self._logged:
            log.warning("the machine departs from its model", **alarm)
        self._logged = heard
        notes = report.get("notes", [])
        for note in notes:
            if note not in self._noted:
                log.info("watch", note=note)
        self._noted = notes

    @property
    def told(self) -> dict[str, Any] | None:
        """The last report with its age in s, and whether the watch is `silent`."""
        if self._report is None:
            return None
        age = time.monotonic() - self._at
        return {**self._report, "silent": age > SILENT, "age_s": round(age, 1)}

    def sentence(self) -> str | None:
        """State of the model as a sentence, as `rtctl status` shows it."""
        told = self.told
        return None if told is None else sentence(told)


def sentence(told: dict[str, Any]) -> str:
    """A report as a sentence."""
    alarm = told.get("alarm")
    if alarm is not None:
        found = f"; {alarm['diagnosis']}" if alarm.get("diagnosis") else ""
        return f"departs from the machine since {alarm['t']:.0f} s: {alarm['words']}{found}"
    if told["silent"]:
        return f"nobody watches: `rtctl watch` is silent for {told['age_s']:.0f} s"
    notes = told.get("notes") or []
    beside = f"; {notes[-1]}" if notes else ""
    if told["state"] == "watching":
        sigma = ", ".join(f"{name} {value:.2g} sigma" for name, value in told["residual"].items())
        return f"holds{': ' + sigma if sigma else ''}{beside}"
    if told["state"] == "learning":
        return f"learns the band of the machine, {100 * told['learned']:.0f} %{beside}"
    if told["state"] == "astray":
        return f"diverges from the rows and cannot judge the machine{beside}"
    return f"waits for motion{beside}"
