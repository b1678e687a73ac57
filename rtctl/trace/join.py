"""Join of rows from shared memory to the end of a recording, or a bundle of these rows alone.

A killed run leaves its last rows in shared memory. Recorded rows do not change. The old file stays until the new file
is on the disk.
"""

import contextlib
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace.bundle import ARROWS, FORMAT, PARQUET, ROW_GROUP, as_json, load_case, part_folders, save_case
from rtctl.trace.bundle import write_parquet as write
from rtctl.trace.columns import Column, record_batch, schema
from rtctl.trace.losses import Losses
from rtctl.trace.part import refuse_taken
from rtctl.trace.repair import gaps, repair


class Joined(NamedTuple):
    folder: Path
    rows: int  # number of rows joined
    first: int | None  # tick of the first joined row; None without rows
    last: int | None
    lost: int  # rows missing before or between the joined rows


def is_of(folder: Path, case: dict[str, Any]) -> bool:
    """Whether the recording in `folder` began with this case. A damaged case.json is repaired first."""
    held = [*part_folders(folder), *(folder / name for name in (ARROWS, PARQUET))] if folder.is_dir() else []
    if case.get("recorded_at") is None or not any(path.exists() for path in held):
        return False
    try:
        found = load_case(folder)
    except UserError:
        repair(folder)
        found = load_case(folder)
    return found.get("recorded_at") == case["recorded_at"]


def join(folder: Path, rows: np.ndarray, columns: Sequence[Column], case: dict[str, Any]) -> Joined:
    """Append the `rows` (structured array, rising ticks) after the last recorded tick; requires `is_of`.

    The recording is repaired first. Raises UserError where the recording is in use, OSError where a write fails.
    """
    with contextlib.suppress(NoAnswer):  # killed before its first row was written
        repair(folder)
    parts = part_folders(folder)
    target = parts[-1] if parts else folder
    last = next((tick for at in reversed(parts or [folder]) if (tick := _last_tick(at)) is not None), -1)
    rows = rows[rows["tick"] > last]
    if not len(rows):
        return Joined(folder, 0, None, None, 0)
    losses = _missing(np.concatenate(([last], rows["tick"])))
    try:
        known = load_case(target)
    except UserError:  # killed during creation of the part
        known = {"format": FORMAT, **case}
    kept = schema(columns, rows.dtype, {"case": as_json(case)})
    before: Iterator[pa.RecordBatch] = iter(())
    count = 0
    if (target / PARQUET).exists():
        file = pq.ParquetFile(target / PARQUET)
        if not file.schema_arrow.equals(kept):
            raise UserError(f"{target / PARQUET} has other columns than the rows in memory; nothing was changed")
        kept, count = file.schema_arrow, file.metadata.num_rows
        before = (pa.RecordBatch.from_arrays(b.columns, schema=kept) for b in file.iter_batches(ROW_GROUP))
    write(target, chain(before, [record_batch(rows, kept)]), kept, expect=count + len(rows))
    done = Joined(folder, len(rows), int(rows["tick"][0]), int(rows["tick"][-1]), losses.rows)
    _save(target, known, count + len(rows), losses, done)
    (target / ARROWS).unlink(missing_ok=True)  # last: a repair needs the stream until here
    if parts:
        repair(folder)  # updates the case of all parts
    return done


def alone(folder: Path, rows: np.ndarray, columns: Sequence[Column], case: dict[str, Any]) -> Joined:
    """Write a bundle of `rows` to a new folder. Raises UserError for a taken folder, OSError where a write fails."""
    refuse_taken(folder)
    folder.mkdir(parents=True, exist_ok=True)
    case = {"format": FORMAT, **case}
    kept = schema(columns, rows.dtype, {"case": as_json(case)})
    losses = _missing(rows["tick"])
    write(folder, [record_batch(rows, kept)], kept, expect=len(rows))
    done = Joined(folder, len(rows), int(rows["tick"][0]), int(rows["tick"][-1]), losses.rows)
    _save(folder, case, len(rows), losses, done)
    return done


def _last_tick(folder: Path) -> int | None:
    """Tick of the last row of a recording without parts; None without rows."""
    if not (folder / PARQUET).exists():
        return None
    file = pq.ParquetFile(folder / PARQUET)
    for group in reversed(range(file.num_row_groups)):
        ticks = file.read_row_group(group, columns=["tick"]).column("tick")
        if len(ticks):
            return int(ticks[-1].as_py())
    return None


def _missing(ticks: np.ndarray) -> Losses:
    losses = Losses()
    for k in np.flatnonzero(np.diff(ticks) > 1):
        losses.add(int(ticks[k]) + 1, int(ticks[k + 1] - ticks[k]) - 1)
    return losses


def _save(folder: Path, case: dict[str, Any], rows: int, losses: Losses, done: Joined) -> None:
    known = case.get("losses")
    counted = known.get("rows", 0) if isinstance(known, dict) else 0
    told = {"rows": counted + losses.rows, "gaps": sorted([*map(list, gaps(case)), *losses.gaps])}
    recovered = {"rows": done.rows, "ticks": [done.first, done.last]}
    case = {**case, "rows": rows, "losses": told, "complete": False, "repaired": True, "recovered": recovered}
    save_case(folder, case)
