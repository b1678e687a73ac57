"""Rotation of long recordings: a bundle of numbered parts, each itself a bundle, with one case.json on top.

    run/case.json                 of all parts: settings, nominal model, rows, losses, and the list `parts`
    run/part-0001/case.json, recording.parquet
    run/part-0002/case.json, recording.arrows      the part in progress

A separate thread converts a full part to Parquet while the next part is written. Rows keep reaching the disk, and the
end of a long run does not wait for the compression of hours of rows.
"""

import os
import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.files import made_in
from rtctl.trace import moved
from rtctl.trace.bundle import PART, index, load_case, save_case
from rtctl.trace.columns import Column
from rtctl.trace.losses import Losses
from rtctl.trace.part import Part, refuse_taken, told
from rtctl.trace.stream import lock

MEGABYTE = 1_000_000
BEGINNING, END = -(2**63), 2**63 - 1  # before the first tick, after the last


class Rotation(NamedTuple):
    """Limits of a part; the first one reached ends the part. None: no limit."""

    megabytes: float | None = None  # size of the stream, which is several times the size of the Parquet file
    minutes: float | None = None  # by the column t


class _Full(NamedTuple):
    part: Part
    losses: Losses


class Parts:
    """Writer of rows with `tick` and `t` into parts of `folder`, which is locked during the recording.

    Has the methods of a `Part`. `lost(first, end)` returns the losses with ticks in [first, end). Raises UserError
    where the folder is taken, OSError where it is not writable.
    """

    def __init__(
        self,
        folder: Path,
        columns: Sequence[Column],
        dtype: np.dtype,
        case: Mapping[str, Any],
        rotation: Rotation,
        lost: Callable[[int, int], Losses],
    ):
        refuse_taken(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.case, self._of, self._lost = folder, dict(case), (columns, dtype), lost
        self._bytes = float("inf") if rotation.megabytes is None else rotation.megabytes * MEGABYTE
        self._seconds = float("inf") if rotation.minutes is None else rotation.minutes * 60.0
        self._failed: list[_Full] = []
        self._known: dict[str, tuple[int, int]] = {}  # first tick and rows of the full parts
        self._looking = threading.Lock()  # the recorder thread and the conversion thread both follow the folder
        self._news: list[str] = []  # sentences that `look` has not returned yet
        self._before = (0, 0)  # rows and bytes of the full parts
        self._number = 0
        self._lock = os.open(folder, os.O_RDONLY)
        try:
            lock(self._lock, folder)
            save_case(folder, {**case, "complete": False, "parts": []})
            self._part = self._next()
        except BaseException:
            self._unlock()
            raise
        self._first_tick = BEGINNING
        self._began = 0  # first tick in the open part
        self._end = self._seconds  # t in s at which the open part is full
        self._full: queue.SimpleQueue[_Full | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._make_bundles, name="parts", daemon=True)
        self._thread.start()

    @property
    def rows(self) -> int:
        return self._before[0] + self._part.rows

    @property
    def bytes(self) -> int:
        return self._before[1] + self._part.bytes

    def write(self, rows: np.ndarray) -> int:
        """Append `rows` to the open part and to as many new parts as needed. Raises OSError as a `Part` does."""
        written = 0
        while len(rows):
            if self._part.rows and (self._part.bytes >= self._bytes or rows["t"][0] >= self._end):
                self._rotate(int(rows["tick"][0]))
            if not self._part.rows:
                self._began = int(rows["tick"][0])
                self._end = float(rows["t"][0]) + self._seconds
            now = max(1, int(np.searchsorted(rows["t"], self._end)))
            written += self._part.write(rows[:now])
            rows = rows[now:]
        return written

    def look(self) -> str | None:
        """Follow the folder as a `Part` does. Full parts in a deleted folder are lost; `finish` counts their rows."""
        with self._looking:
            self._look_on_top()
            wanted = self.folder / self._part.folder.name
            if self._part.follow(wanted) and not self._news:
                self._news.append(
                    f"{wanted} was moved or deleted while it was recorded: its rows are rescued into a new one"
                )
            told, self._news = "; ".join(self._news) or None, []
            return told

    def _look_on_top(self) -> None:
        """Follow the folder of all parts, or create another folder for the next parts."""
        if self._lock < 0 or moved.in_place(self._lock, self.folder):
            return
        before, now = self.folder, moved.place(self._lock)
        if now is not None:
            self.folder = now
            self._news.append(f"{before} was renamed while it was recorded: the recording is now {now}")
            return
        folder = moved.beside(before)
        folder.mkdir(parents=True)
        save_case(folder, {**self.case, "complete": False, "parts": []})
        guard = os.open(folder, os.O_RDONLY)
        lock(guard, folder)
        self._unlock()
        self._lock, self.folder = guard, folder
        gone = f"; {len(self._known)} full parts went with it" if self._known else ""
        self._news.append(f"{before} was deleted while it was recorded: its rows are rescued into {folder}{gone}")

    def close(self) -> None:
        """Close the open part. Raises OSError where its end cannot be written."""
        self._part.close()

    def finish(self, extra: Mapping[str, Any], losses: Losses, error: Exception | None) -> None:
        """Finish all parts, write the case on top, and update the case of each part.

        Raises OSError where a write fails. The streams of unfinished parts then stay, for `repair` or another call.
        """
        if self._thread.is_alive():
            self._known[self._part.folder.name] = (self._began, self._part.rows)
            self._full.put(_Full(self._part, self._lost(self._first_tick, END)))
            self._full.put(None)
            self._thread.join()
        again, self._failed = self._failed, []
        for full in again:  # disk space may have been freed since
            self._make(full)
        found = index(self.folder)
        there = {entry["folder"] for entry in found["parts"]} | {full.part.folder.name for full in self._failed}
        gone = [part for name, part in self._known.items() if name not in there and part[1]]
        for tick, count in gone:  # part deleted by the user, alone or with the whole folder
            losses.add(tick, count)
        rows = self.rows - sum(count for _, count in gone)
        known = {**self.case, **extra, "rows": rows, **told(losses, error), **found}
        try:
            save_case(self.folder, {**known, "complete": known["complete"] and not self._failed})
            for entry in known["parts"]:
                part = self.folder / entry["folder"]
                save_case(part, {**load_case(part), **_until(entry.get("tick", [0, END])[1], extra)})
        finally:
            self._unlock()
        if self._failed:
            raise OSError(f"{len(self._failed)} parts could not be made whole, {self._failed[0].part.folder} first")

    def _unlock(self) -> None:
        if self._lock >= 0:
            os.close(self._lock)
        self._lock = -1

    def _rotate(self, tick: int) -> None:
        with self._looking:
            self._look_on_top()  # else the next part would recreate a folder that was moved or deleted
        part = self._next()  # first: on a full disk the open part stays open
        self._before = (self.rows, self.bytes)
        self._known[self._part.folder.name] = (self._began, self._part.rows)
        self._full.put(_Full(self._part, self._lost(self._first_tick, tick)))
        self._part, self._first_tick = part, tick

    def _next(self) -> Part:
        self._number += 1
        return Part(made_in(self.folder, PART.format(self._number)), *self._of, {**self.case, "part": self._number})

    def _make_bundles(self) -> None:
        while (full := self._full.get()) is not None:
            self._make(full)

    def _make(self, full: _Full) -> None:
        try:
            with self._looking:
                self._look_on_top()
                full.part.follow(self.folder / full.part.folder.name)
            full.part.close()
            full.part.finish({}, full.losses, None)
        except Exception:  # mostly a full disk; the stream stays, `finish` tries again and reports
            self._failed.append(full)


def _until(tick: int, extra: Mapping[str, Any]) -> dict[str, Any]:
    """`extra` at a tick: lists of events, such as `changes`, end at the tick."""
    return {key: [each for each in value if not _after(each, tick)] if isinstance(value, list) else value
            for key, value in extra.items()}  # fmt: skip


def _after(event: Any, tick: int) -> bool:
    return isinstance(event, dict) and isinstance(event.get("tick"), int) and event["tick"] > tick
