"""Repair of a killed recording: a finished bundle from its stream.

All whole batches are kept and no row is invented: the result is a prefix of the rows given to the recorder. A second
repair changes nothing.
"""

import contextlib
import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.files import inside
from rtctl.trace.bundle import ARROWS, CASE, FORMAT, PARQUET, index, load_case, part_folders, save_case, write_parquet
from rtctl.trace.losses import Losses
from rtctl.trace.stream import StreamReader, lock

BROKEN = CASE + ".broken"


class RepairReport(NamedTuple):
    folder: Path
    rows: int  # in the bundle
    discarded_bytes: int  # of an incomplete batch
    changed: bool  # False: nothing was to be repaired
    notes: tuple[str, ...]  # sentences for the user

    def __str__(self) -> str:
        done = "repaired" if self.changed else "nothing to repair"
        return "\n".join(
            (f"{self.folder}: {done}, {self.rows} rows, {self.discarded_bytes} bytes discarded", *self.notes)
        )


def repair(folder: Path | str) -> RepairReport:
    """Repair `recording.parquet` and `case.json` of a recording, with all its parts; returns a report.

    Raises UserError where there is no recording or it is still being written. Raises NoAnswer, and leaves the file as
    it is, where the recording was killed before its first readable bytes. Raises OSError where a write fails.
    """
    folder = Path(folder)
    parts = part_folders(folder)
    if parts and not any((folder / name).exists() for name in (ARROWS, PARQUET)):
        return _parts(folder, parts)
    return _piece(folder)


def _piece(folder: Path) -> RepairReport:
    """Repair a recording without parts, or one part."""
    stream = inside(folder / ARROWS, folder)
    rows = _rows_in(inside(folder / PARQUET, folder))
    if stream.is_file():
        report = _from_stream(folder, rows)
        stream.unlink()
    elif rows is not None:
        report = _case_only(folder, rows)
    else:
        raise UserError(f"{folder} holds neither {ARROWS} nor a readable {PARQUET}; there is nothing to repair")
    for name in (CASE, PARQUET):
        for left in (folder / f"{name}.tmp", *folder.glob(f".{name}.*.tmp")):  # left by a killed recorder
            with contextlib.suppress(OSError):
                left.unlink(missing_ok=True)
    return report


def _parts(folder: Path, parts: list[Path]) -> RepairReport:
    guard = os.open(folder, os.O_RDONLY)
    try:
        lock(guard, folder)
        reports, notes = [], []
        for part in parts:
            try:
                reports.append(_piece(part))
            except (NoAnswer, UserError) as error:  # killed directly after creation of the part
                notes.append(str(error))
        changed = any(report.changed for report in reports)
        notes += [note for report in reports for note in report.notes]
        rows = sum(report.rows for report in reports)
        discarded = sum(report.discarded_bytes for report in reports)
        if not rows:
            raise NoAnswer(f"{folder}: killed before its first row was written: " + "; ".join(notes))
        return RepairReport(folder, rows, discarded, _on_top(folder, rows, notes) or changed, tuple(notes))
    finally:
        os.close(guard)


def _on_top(folder: Path, rows: int, notes: list[str]) -> bool:
    """Keep the case of all parts where it lists them, else rebuild it; returns whether it was rebuilt."""
    found = index(folder)
    try:
        case = load_case(folder)
        if (case.get("parts"), case.get("rows")) == (found["parts"], rows):
            return False
    except UserError as error:
        _not_refused(error)
        newest = folder / found["parts"][-1]["folder"]  # the newest part holds all changes of settings
        case = {**load_case(newest), "losses": {}}
        case.pop("part", None)
        notes.append(f"{folder / CASE} was made again from that of {newest.name}")
    losses, last = Losses(), None
    cases = [load_case(folder / entry["folder"]) for entry in found["parts"]]
    for entry, part in zip(found["parts"], cases, strict=True):
        first_tick, last_tick = entry.get("tick", (None, None))
        if last is not None and first_tick is not None:
            losses.add(last + 1, first_tick - last - 1)
        for tick, count in gaps(part):
            if first_tick is not None and first_tick <= tick < last_tick:
                losses.add(tick, count)
        last = last_tick if last_tick is not None else last
    _save(folder, {**case, **found}, rows, losses, sum(_discarded(case) for case in cases))
    return True


def _discarded(case: dict[str, Any]) -> int:
    told = case.get("discarded_bytes", 0)
    return told if isinstance(told, int) else 0


def gaps(case: dict[str, Any]) -> list[tuple[int, int]]:
    """Gaps (first tick, count) listed in the case of a part."""
    losses = case.get("losses")
    listed = losses.get("gaps") if isinstance(losses, dict) else None
    pairs = [gap for gap in listed if isinstance(gap, list) and len(gap) == 2] if isinstance(listed, list) else []
    return [(tick, count) for tick, count in pairs if isinstance(tick, int) and isinstance(count, int)]


def _from_stream(folder: Path, in_parquet: int | None) -> RepairReport:
    reader = StreamReader(folder / ARROWS)
    losses = Losses()
    _tally(reader, losses)
    rows, discarded = reader.rows, reader.path.stat().st_size - reader.bytes
    made = in_parquet is None or rows > in_parquet  # else the kill came after verification of the Parquet file
    if made:
        if reader.schema is None:
            raise NoAnswer(f"{reader.path} ends before its list of columns: killed before its first row was written")
        try:
            rows = write_parquet(folder, reader, reader.schema, expect=rows)
        except pa.ArrowException as error:
            raise UserError(f"{reader.path} is damaged and cannot be made whole: {error}") from None
    else:
        rows = in_parquet or 0
    case, notes = _case(folder)
    if made or notes or case.get("rows") != rows:
        _save(folder, case, rows, losses, discarded)
    return RepairReport(folder, rows, discarded, True, notes)


def _case_only(folder: Path, rows: int) -> RepairReport:
    case, notes = _case(folder)
    if notes:
        _save(folder, case, rows, Losses(), 0)
    return RepairReport(folder, rows, _discarded(case), bool(notes), notes)


def _save(folder: Path, case: dict[str, Any], rows: int, losses: Losses, discarded: int) -> None:
    known = case.get("losses")
    counted = known.get("rows") if isinstance(known, dict) else None
    if not isinstance(counted, int) or counted < losses.rows:
        known = losses.as_dict()  # the recorder's count, where it exists, includes losses at the end
    case = {**case, "rows": rows, "losses": known, "complete": False}
    try:
        save_case(folder, {**case, "repaired": True, "discarded_bytes": discarded})
    except ValueError:  # Python reads NaN from JSON, but `as_json` refuses to write it
        raise UserError(f"{folder / CASE} holds NaN or Infinity, which JSON does not know; write null there") from None


def _tally(reader: StreamReader, losses: Losses) -> None:
    """Read all whole batches; missing ticks between rows count as lost."""
    last: int | None = None
    for batch in reader:
        numbered = batch.schema.get_field_index("tick") >= 0 and pa.types.is_int64(batch.column("tick").type)
        if batch.num_rows and numbered:
            ticks = batch.column("tick").to_numpy()
            ticks = ticks if last is None else np.concatenate(([last], ticks))
            for k in np.flatnonzero(np.diff(ticks) > 1):
                losses.add(int(ticks[k]) + 1, int(ticks[k + 1]) - int(ticks[k]) - 1)
            last = int(ticks[-1])


def _case(folder: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Case, and notes about its repair. An unreadable file is renamed, never deleted."""
    inside(folder / CASE, folder)
    try:
        return load_case(folder), ()
    except UserError as error:
        _not_refused(error)
        notes = [str(error)]
    path = folder / CASE
    if path.exists():
        path.replace(folder / BROKEN)
        notes.append(f"what was left of it is in {BROKEN}")
    case = _embedded(folder)
    if case is None:
        notes.append(f"{CASE} now holds no more than this; fill in plant, sample_rate and parameters")
        return {"format": FORMAT}, tuple(notes)
    notes.append(f"{CASE} was made again from the copy inside the recording")
    return case, tuple(notes)


def _not_refused(error: UserError) -> None:
    """Raise `error` where the system refused the read (permission, limit of open files): the file may be whole."""
    if isinstance(error.__cause__, OSError):
        raise error


def _embedded(folder: Path) -> dict[str, Any] | None:
    """Copy of the case inside the recording."""
    text = (pq.read_schema(folder / PARQUET).metadata or {}).get(b"case")
    return json.loads(text) if text else None


def _rows_in(parquet: Path) -> int | None:
    """Number of rows of a Parquet file; None for a missing or damaged file. Raises OSError without permission."""
    try:
        return pq.read_metadata(parquet).num_rows
    except FileNotFoundError:
        return None
    except OSError as error:
        if error.errno is not None:  # error of the system; the error of a damaged file has no errno
            raise
        return None
    except pa.ArrowException:
        return None
