"""Monitor of a recording: its rows streamed from the disk in pieces, in constant memory."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace.bundle import load_case, no_folder, recordings
from rtctl.watch.band import Band
from rtctl.watch.kept import identity, load_band, save_band
from rtctl.watch.monitor import LEARN, Alarm, Monitor

PIECE = 16_384  # rows in memory at a time
NEEDED = ("tick", "t", "state")


def rows_of(bundle: Path) -> Iterator[np.ndarray]:
    """Rows of a bundle and all its parts, PIECE at a time, as structured arrays. Raises UserError."""
    if not bundle.is_dir():
        raise no_folder(bundle)
    for path in recordings(bundle):
        with pq.ParquetFile(path) as file:
            for batch in file.iter_batches(PIECE):
                columns = {name: batch.column(name).to_numpy(zero_copy_only=False) for name in batch.schema.names}
                for name in NEEDED:
                    if name not in columns:
                        raise UserError(f"{path} has no column '{name}'; watch reads recordings of `rtctl run`")
                rows = np.empty(batch.num_rows, [(name, values.dtype) for name, values in columns.items()])
                for name, values in columns.items():
                    rows[name] = values
                yield rows


def watch_bundle(bundle: Path, say: Callable[[str], None], model: Path | None = None, band: Path | None = None,
                 seconds: float = LEARN) -> list[Alarm]:  # fmt: skip
    """Alarms of a recording. `band` is a file with a band that was learned before, or a new file for the band.

    Raises UserError where the bundle is no recording of a machine, NoAnswer where it ends before a band is learned.
    """
    case = load_case(bundle)
    said = identity(case, model)
    known: Band | None = load_band(band, said) if band is not None and band.exists() else None
    monitor = Monitor(case, model, seconds, known)
    alarms = []
    for rows in rows_of(bundle):
        alarm = monitor.feed(rows)
        for note in monitor.notes:
            say(note)
        monitor.notes.clear()
        if alarm is not None:
            alarms.append(alarm)
            say(f"t = {alarm.t:.0f} s: the machine departs from its model, from {alarm.began:.0f} s on: {alarm.words}")
    if monitor.band is None:
        raise NoAnswer(
            f"{bundle} ends before the band is learned ({100 * monitor.learned:.0f} % of {seconds:g} s in motion); "
            "give a shorter --learn, or a --band that was learned from another recording of the machine"
        )
    if known is None and band is not None:
        save_band(band, monitor.band, said)
        say(f"the band is written to {band}")
    say(f"{monitor.judged} windows judged, {monitor.untimely} with late rows and {monitor.faster} faster ones left out")
    return alarms
