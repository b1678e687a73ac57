"""Answers of a running machine: its current state, counts, times and signals."""

import os
from typing import Any

from rtctl.daemon import tap
from rtctl.daemon.watched import Watched
from rtctl.loop import generate
from rtctl.loop.histogram import percentiles
from rtctl.loop.records import STAGES, late_ticks
from rtctl.loop.ring import Reader
from rtctl.machines import Machine
from rtctl.tick import safety
from rtctl.tick.memory import Segment
from rtctl.trace.recorder import Recorder


class Answers:
    """Read-only part of the supervisor: answers from its records."""

    config: Any
    machine: Machine
    made: generate.Generated
    link: str
    segment: Segment
    status: Any
    reader: Reader
    recorder: Recorder | None
    server: Any
    faults: Any
    watched: Watched
    lacks: list[str]
    failure: Exception | None = None  # why the run ended by itself, once it has
    last_row: Any = None

    def snapshot(self) -> dict[str, Any]:
        """Current state, counts and times, as in `rtctl status` and in the run's JSON."""
        s = self.status
        trip = safety.TRIPS[int(s["trip"])]
        return {
            "name": self.config.name,
            "machine": self.machine.kind,
            "mode": self.config.loop.mode,
            "link": self.link if self.config.loop.mode != "fused" else "none",
            "pid": os.getpid(),
            "state": safety.STATES[int(s["state"])],
            "trip": None if not s["trip"] else {"code": trip[0], "why": trip[1], "tick": int(s["trip_tick"])},
            "failure": str(self.failure) if self.failure else None,
            "ticks": int(s["tick"]),
            "rate_hz": self.machine.rate,
            "measured_rate_hz": self._measured_rate(),
            "missed": int(s["missed"]),
            "late": int(s["late"]),
            "overruns": int(s["overruns"]),
            "lateness_us": percentiles(s["lateness"]),
            "tick_us": percentiles(s["ticks"]),
            "exchange_us": percentiles(s["exchange"]),
            "stages_us": {name: percentiles(s[field]) for name, field in STAGES.items()},
            "late_ticks": late_ticks(s),
            "link_latency_us": percentiles(s["round_trip"]),
            "sample_age_us": percentiles(s["age"]),
            "frames": {"received": int(s["link_frames"]), "not_sent": int(s["link_dropped"])},
            "lost_counts": int(s["lost_counts"]),
            "rows": self.rows_counted(),
            "refused_commands": dict(self.server.refused),
            "lacks": self.lacks,
            "faults": self.faults.told,
            "model": self.watched.told,
        }

    def report(self) -> dict[str, Any]:
        """The snapshot and the newest row: answer to `status` of the command socket."""
        row = self.last_row
        return {**self.snapshot(), "signals": {} if row is None else {n: float(row[n]) for n in row.dtype.names}}

    def signals(self) -> dict[str, Any]:
        """Names, units and descriptions of the columns, and the place of their rows: answer to `signals`."""
        columns = [{"name": c.name, "unit": c.unit, "help": c.help} for c in self.made.columns]
        return {"signals": columns, "ring": tap.describe(self.segment)}

    def rows_counted(self) -> dict[str, Any]:
        """Counts of trace rows: lost in the ring, recorded, queued, lost by the recorder."""
        lost = {"lost_in_ring": self.reader.lost}
        if self.recorder is None:
            return lost
        stats = self.recorder.stats()
        return {
            **lost,
            "recorded": stats.rows_written,
            "queued": stats.rows_queued,
            "lost": stats.rows_lost,
            "error": stats.error,
        }

    def _measured_rate(self) -> float | None:
        if self.last_row is None or self.last_row["t"] <= 0:
            return None
        return round(float(self.last_row["tick"] / self.last_row["t"]), 3)
