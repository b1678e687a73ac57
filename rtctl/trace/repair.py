"""Makes a bundle of what a killed recording left behind.

All batches that are whole are kept, and no row that was not recorded is made up: the result is a prefix of what the
recorder was given. Doing it again changes nothing.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace.bundle import ARROWS, CASE, FORMAT, PARQUET, load_case, save_case, write_parquet
from rtctl.trace.losses import Losses
from rtctl.trace.stream import StreamReader

BROKEN = CASE + ".broken"


class RepairReport(NamedTuple):
    folder: Path
    rows: int  # in the bundle
    discarded_bytes: int  # of a batch that was not whole
    changed: bool  # False: there was nothing to do
    notes: tuple[str, ...]  # sentences for people

    def __str__(self) -> str:
        done = "repaired" if self.changed else "nothing to repair"
        return "\n".join(
            (f"{self.folder}: {done}, {self.rows} rows, {self.discarded_bytes} bytes discarded", *self.notes)
        )


def repair(folder: Path | str) -> RepairReport:
    """Make `recording.parquet` and `case.json` whole.

    Raises UserError where there is no recording or it is still being written, NoAnswer where it was killed before the
    first bytes that could be read (its file is left as it is), OSError where the disk does not take the result.
    """
    folder = Path(folder)
    stream = folder / ARROWS
    rows = _rows_in(folder / PARQUET)
    if stream.is_file():
        report = _from_stream(folder, rows)
        stream.unlink()
    elif rows is not None:
        report = _case_only(folder, rows)
    else:
        raise UserError(f"{folder} holds neither {ARROWS} nor a readable {PARQUET}; there is nothing to repair")
    for name in (CASE, PARQUET):
        (folder / (name + ".tmp")).unlink(missing_ok=True)
    return report


def _from_stream(folder: Path, in_parquet: int | None) -> RepairReport:
    reader = StreamReader(folder / ARROWS)
    losses = Losses()
    _tally(reader, losses)
    rows, discarded = reader.rows, reader.path.stat().st_size - reader.bytes
    made = in_parquet is None or rows > in_parquet  # else it was killed after the Parquet file was verified
    if made:
        if reader.schema is None:
            raise NoAnswer(f"{reader.path} ends before its list of columns: killed before its first row was written")
        rows = write_parquet(folder, reader, reader.schema, expect=rows)
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
    return RepairReport(folder, rows, int(case.get("discarded_bytes", 0)), bool(notes), notes)


def _save(folder: Path, case: dict[str, Any], rows: int, losses: Losses, discarded: int) -> None:
    known = case.get("losses", {})
    if known.get("rows", 0) < losses.rows:  # what the recorder counted is better: it knows what is lost at the end, too
        known = losses.as_dict()
    case = {**case, "rows": rows, "losses": known or losses.as_dict(), "complete": False}
    save_case(folder, {**case, "repaired": True, "discarded_bytes": discarded})


def _tally(reader: StreamReader, losses: Losses) -> None:
    """Read all that is whole; ticks that are missing in between were lost."""
    last: int | None = None
    for batch in reader:
        if "tick" in batch.schema.names and batch.num_rows:
            ticks = batch.column("tick").to_numpy()
            ticks = ticks if last is None else np.concatenate(([last], ticks))
            for k in np.flatnonzero(np.diff(ticks) > 1):
                losses.add(int(ticks[k]) + 1, int(ticks[k + 1] - ticks[k]) - 1)
            last = int(ticks[-1])


def _case(folder: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The case, and what had to be done to have one. A file that cannot be read is put aside, never thrown away."""
    try:
        return load_case(folder), ()
    except UserError as error:
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


def _embedded(folder: Path) -> dict[str, Any] | None:
    """The case as the recorder put it into the recording."""
    text = (pq.read_schema(folder / PARQUET).metadata or {}).get(b"case")
    return json.loads(text) if text else None


def _rows_in(parquet: Path) -> int | None:
    try:
        return pq.read_metadata(parquet).num_rows
    except (OSError, pa.ArrowException):
        return None
