"""Monitor of one machine: rows of its trace in, measures, notes and alarms out. It reads no clock and opens nothing.

The monitor waits for motion, reads a first record as the diagnosis does, learns the band of the healthy machine, and
then judges. Missing rows, jumps of the clock and divergence of the model give notes and no alarm.
"""

from collections import deque
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.answer.load import of_bundle
from rtctl.diagnose.model.model import nominal
from rtctl.tick.safety import RUNNING
from rtctl.trace.bundle import Bundle
from rtctl.watch.band import Band, learn
from rtctl.watch.cusum import Sums
from rtctl.watch.observer import Observer
from rtctl.watch.readings import Readings
from rtctl.watch.windows import Batch, Cutter, Shape, joined
from rtctl.watch.words import sentence

LEARN = 600.0  # s in motion, from which the band is learned
FIRST = 10.0  # s in one stretch, after which a record is tried
LONGEST = 120.0  # s of a first record; where it supports no model, its older half is dropped
JUMP = 0.25  # s, deviation of the time between two rows from the tick, beyond which the clock has jumped
RECENT = 120  # windows kept for the sentence of an alarm
BLIND = (60, 0.5)  # windows in motion, and the share of judged ones below which a note is made
AWAY = 3  # divergences of a model in RECENT windows, from which on the model is not used


class Alarm(NamedTuple):
    """The machine departs from its model."""

    t: float  # s, controller clock at the end of the window
    began: float  # s, controller clock at which the sum began to rise
    sensor: str
    measure: str
    words: str

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return self._asdict()


class Monitor:
    """Monitor of rows by the model of `case` (a bundle's case.json). `notes` are sentences on faults of rows or model;
    the caller takes them out.

    `band` is a band that was learned before. Raises UserError where the machine cannot be followed.
    """

    def __init__(self, case: dict[str, Any], model: Path | None = None, seconds: float = LEARN,
                 band: Band | None = None):  # fmt: skip
        self.case, self._model, self.seconds = case, model, seconds
        self.band = band
        self.notes: list[str] = []
        self.lost = self.untimely = self.faster = self.judged = 0
        self.alarm: Alarm | None = None
        self.latest: Batch | None = None
        self.sums = Sums(band.limits) if band is not None else None
        self._observer: Observer | None = None
        self._first: list[dict[str, np.ndarray]] = []
        self._learned: list[Batch] = []
        self._recent: deque[Batch] = deque(maxlen=RECENT)
        self._before: Any = None
        self._seen = (0, 0, 0)  # windows judged, with late rows, and too fast, at the last note on them
        self._blind = False
        self._end: tuple[int, float] | None = None  # tick and time of the last row
        self._away: deque[int] = deque(maxlen=AWAY)
        self.windows = 0

    @property
    def state(self) -> str:
        """State of the monitor: waiting, learning, watching, astray."""
        if self._observer is None:
            return "waiting"
        if self.astray:
            return "astray"
        return "learning" if self.band is None else "watching"

    @property
    def astray(self) -> bool:
        """Whether the model diverges repeatedly."""
        return len(self._away) == AWAY and self.windows - self._away[0] < RECENT

    @property
    def learned(self) -> float:
        """Progress of learning: share of the motion that the band needs, 0 to 1."""
        if self.band is not None:
            return 1.0
        return min(self._in_motion() / self.seconds, 1.0) if self._learned else 0.0

    def restart(self) -> None:
        """Begin a new run of the machine with the next row."""
        self._end = None
        self._break()

    def feed(self, rows: np.ndarray, lost: int = 0) -> Alarm | None:
        """Process rows of the trace, oldest first; `lost` rows are missing before them. Returns the first alarm of
        these rows, None without an alarm."""
        if lost:
            self._lose(lost)
        found: Alarm | None = None
        for piece in self._pieces(rows):
            alarm = self._take(piece)
            found = found or alarm
        return found

    # rows

    def _pieces(self, rows: np.ndarray) -> list[np.ndarray]:
        """Stretches of running rows without a gap, with a break before each that does not follow the last row."""
        if not len(rows):
            return []
        tick, t = rows["tick"].astype(np.int64), rows["t"].astype(float)
        last = self._end or (int(tick[0]) - 1, float(t[0]) - self._dt)
        steps = np.diff(tick, prepend=last[0])
        missing = steps != 1
        jumps = ~missing & (np.abs(np.diff(t, prepend=last[1]) - self._dt) > JUMP)
        self._end = int(tick[-1]), float(t[-1])
        gone = int(np.maximum(steps[missing] - 1, 0).sum())
        if gone:
            self.lost += gone
            self.notes.append(f"{gone} rows did not come; the model begins anew behind them")
        if (steps[missing] < 1).any():
            self.notes.append("the ticks count from the start again: the loop was started anew")
        for k in np.flatnonzero(jumps):
            off = float(t[k] - (t[k - 1] if k else last[1]) - self._dt)
            self.notes.append(f"the clock of the rows jumped by {off:+.3g} s at tick {tick[k]}; the model begins anew")
        runs = rows["state"] == RUNNING
        edge = missing | jumps | (np.diff(runs.astype(np.int8), prepend=runs[:1].astype(np.int8)) != 0)
        edge[0] |= bool(runs[0]) and not self._ran
        pieces = []
        for begin, end in zip(*_stretches(edge), strict=True):
            if runs[begin]:
                if edge[begin]:
                    pieces.append(np.empty(0, rows.dtype))  # a break
                pieces.append(rows[begin:end])
        self._ran = bool(runs[-1])
        return pieces

    _ran = False

    @property
    def _dt(self) -> float:
        return 1.0 / float(self.case["sample_rate"])

    def _lose(self, count: int) -> None:
        self.lost += count
        self.notes.append(f"{count} rows were overwritten before they were read; the model begins anew behind them")
        self._end = None
        self._break()

    def _break(self) -> None:
        self._first, self._before = [], None
        if self._observer is not None:
            self._readings.restart()
            self._cutter.restart()

    def _take(self, piece: np.ndarray) -> Alarm | None:
        if not len(piece):
            self._break()
            return None
        columns = {name: piece[name] for name in piece.dtype.names or ()}
        if self._observer is None:
            self._first.append(columns)
            begun = self._begin()
            if begun is None:
                return None
            columns = begun
        u, y, ref = self._readings.take(columns)
        away = self._cutter.away
        batch = self._cutter.feed(columns["t"], u, y, ref, self._late(columns))
        if self._cutter.away > away:
            self._away.append(self.windows)
            self.notes.append("the model diverged from the rows and was started again" + (
                "; it diverges repeatedly and cannot judge this machine" if self.astray else ""))  # fmt: skip
        return None if batch is None else self._judge(batch)

    def _late(self, columns: dict[str, np.ndarray]) -> np.ndarray:
        """Errors of time (n,) of rows, s: of the period, and of the age of the sample."""
        out = np.abs(np.diff(columns["t"], prepend=columns["t"][0] - self._dt) - self._dt)
        age = columns.get("link_age")
        if age is not None:
            out = np.maximum(out, np.abs(age - np.median(age)))
        return np.where(np.isfinite(out), out, 0.0)

    # the model

    def _begin(self) -> dict[str, np.ndarray] | None:
        """The columns of the first record, once it supports a model; None until then."""
        rows = sum(len(part["t"]) for part in self._first)
        if rows * self._dt < self._next:
            return None
        columns = {name: np.concatenate([part[name] for part in self._first]) for name in self._first[0]}
        folder = Path("the first rows")
        try:
            record = of_bundle(Bundle(columns, self.case, folder, {}), self._model)
        except NoAnswer:
            self._next = rows * self._dt + FIRST
            if self._next > LONGEST:
                self._first = [{name: values[rows // 2 :] for name, values in columns.items()}]
                self._next = LONGEST / 2 + FIRST
            return None
        self._observer = Observer(record, nominal(record.case))
        self._readings = Readings(record, columns, Readings.bends(self.case.get("config")))
        self._cutter = Cutter(self._observer)
        self._first = []
        if self.band is not None and self.band.sensors != tuple(self._observer.sensors):
            raise UserError(
                f"the band was learned with the sensors {', '.join(self.band.sensors)}; the rows show "
                f"{', '.join(self._observer.sensors)}"
            )
        return columns

    _next = FIRST

    @property
    def observer(self) -> Observer | None:
        """The model, once the first record is read."""
        return self._observer

    @property
    def shape(self) -> Shape:
        """Lengths of windows and blocks, once the first record is read."""
        return self._cutter.shape

    def _in_motion(self) -> float:
        """Motion that was kept for learning, s."""
        v = np.concatenate([np.abs(batch.v) for batch in self._learned])
        assert self._observer is not None
        limit = self._grain() / (self._cutter.shape.slow * self._cutter.shape.dt)
        return float((v > limit).any(axis=2).mean(axis=1).sum() * self._cutter.shape.seconds)

    def _grain(self) -> np.ndarray:
        assert self._observer is not None
        grain = self._observer.sim.record.grain
        return np.array([grain[self._observer.sensors[k]] for k in self._observer.followed])

    def _judge(self, batch: Batch) -> Alarm | None:
        self.windows += batch.size
        self.latest = batch
        if self.band is None:
            self._learned.append(batch)
            if self._in_motion() >= self.seconds:
                self._learn()
            return None
        band, sums = self.band, self.sums
        assert sums is not None and self._observer is not None
        moving, counts = band.in_motion(batch), band.counts(batch)
        untimely = int((moving & band.untimely(batch)).sum())
        self.untimely += untimely
        self.faster += int(moving.sum()) - int(counts.sum()) - untimely
        batch = batch.some(counts)
        self.judged += batch.size
        self._look_around()
        if not batch.size or self.astray:
            return None
        weights, self._before = band.weights(batch, self._before)
        found: Alarm | None = None
        for k, (score, weight) in enumerate(zip(band.scores(batch), weights, strict=True)):
            self._recent.append(batch.some(slice(k, k + 1)))
            top = sums.step(score, float(weight))
            if top is not None:
                rising = joined(list(self._recent)[-int(sums.rising[top]) :])
                measure = band.signed()[top]
                words = sentence(self._observer, band, measure, rising)
                alarm = Alarm(float(rising.t[-1]), float(rising.t[0]), measure.of, measure.what, words)
                found = found or alarm
                sums.restart()
        self.alarm = self.alarm or found
        return found

    def _look_around(self) -> None:
        """Note when most of the motion is not judged, and when most of it is judged again."""
        now = self.judged, self.untimely, self.faster
        judged, untimely, faster = (a - b for a, b in zip(now, self._seen, strict=True))
        count = judged + untimely + faster
        if count < BLIND[0]:
            return
        self._seen, blind = now, judged < BLIND[1] * count
        if blind and not self._blind:
            self.notes.append(
                f"of the last {count} windows in motion {judged} were judged: {untimely} had rows that came later, "
                f"{faster} were faster than when the band was learned; an alarm may come late, or not at all"
            )
        elif self._blind and not blind:
            self.notes.append("most of the motion is judged again")
        self._blind = blind

    def _learn(self) -> None:
        assert self._observer is not None
        whole = joined(self._learned)
        sensors, followed = self._observer.sensors, self._observer.followed
        try:
            self.band = learn(whole, self._cutter.shape, sensors, followed, self._grain())
        except NoAnswer:
            return
        self.sums = Sums(self.band.limits)
        self._learned = []


def _stretches(edge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Begins and ends of the stretches between edges (n,)."""
    begins = np.flatnonzero(edge)
    if not len(begins) or begins[0] != 0:
        begins = np.concatenate(([0], begins))
    return begins, np.append(begins[1:], len(edge))
