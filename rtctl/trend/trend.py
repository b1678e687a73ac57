"""Trend of a folder of recordings: estimates of every piece, changes, one table and one page."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from rtctl import workers
from rtctl.config.errors import NoAnswer, UserError
from rtctl.trend import table
from rtctl.trend.estimate import estimates
from rtctl.trend.pieces import WINDOW, Piece, bundles_in, pieces_of
from rtctl.trend.series import LEAST, Judged, judge, series_of

BATCH = 8  # pieces of a task
PAGE = "trend.html"

Rows = list[dict[str, Any]]
Progress = Callable[[int, int, int], None]  # pieces done, of how many, without an estimate so far


def run(
    paths: Sequence[Path],
    folder: Path,
    jobs: int = 1,
    scheduler: str | None = None,
    window: float = WINDOW,
    least: float = LEAST,
    again: bool = False,
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """Fit the pieces without rows in `folder`, test for changes, write table and page there. Returns the object of
    `--json`.

    Raises UserError where a path is no bundle or the disk refuses a file, NoAnswer where no piece gives an estimate,
    and PoolError where a worker dies; finished estimates are then kept.
    """
    began = time.monotonic()
    rows, fitted = gathered(paths, folder, jobs, scheduler, window, again, progress)
    if all(row["error"] is not None for row in rows):
        raise NoAnswer(f"none of {len(rows)} recordings gives an estimate; the first: {rows[0]['error']}")
    judged = judge(series_of(rows))
    from rtctl.trend import page

    written = page.write(folder / PAGE, judged, rows, least)
    found = summary(judged, rows, least)
    return found | {
        "fitted": fitted, "wall_s": round(time.monotonic() - began, 3),
        "table": str(folder / table.TABLE), "page": str(written),
    }  # fmt: skip


def gathered(
    paths: Sequence[Path],
    folder: Path,
    jobs: int,
    scheduler: str | None,
    window: float,
    again: bool,
    progress: Progress,
) -> tuple[Rows, int]:
    """Rows of the table of all pieces, and the number of newly fitted pieces."""
    pieces, broken = _pieces([bundle.resolve() for bundle in bundles_in(paths)], window)
    known = {} if again else table.kept(folder, pieces)
    left = [piece for piece in pieces if piece not in known]
    done, bad = len(known), len(broken)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out {folder}: cannot be written: {error.strerror}") from None
    progress(done, len(pieces), bad)
    try:
        for batch, found in computed(left, jobs, scheduler):
            known.update(zip(batch, found, strict=True))
            done, bad = done + len(batch), bad + sum(rows[0].get("error") is not None for rows in found)
            progress(done, len(pieces), bad)
    finally:
        if known or broken:
            table.write(folder, _ordered(pieces, known, broken))
    return table.read(folder), len(left)


def _ordered(pieces: Iterable[Piece], known: dict[Piece, Rows], broken: Rows) -> Rows:
    return [row for piece in pieces if piece in known for row in known[piece]] + broken


def _pieces(bundles: Sequence[Path], window: float) -> tuple[list[Piece], Rows]:
    """Pieces of all bundles, and a row with `error` for each bundle that cannot be read."""
    pieces: list[Piece] = []
    broken: Rows = []
    for bundle in bundles:
        try:
            pieces += pieces_of(bundle, window)
        except UserError as error:
            broken.append({"machine": bundle.resolve().parent.name, "folder": str(bundle), "error": str(error)})
    return pieces, broken


def computed(pieces: Sequence[Piece], jobs: int, scheduler: str | None) -> Iterator[tuple[list[Piece], list[Rows]]]:
    """Rows of each piece, batch by batch as they are done: here, by `jobs` processes or by a scheduler's workers."""
    if scheduler is None and (jobs == 1 or len(pieces) < 2 * BATCH):
        for piece in pieces:
            yield [piece], estimates([piece])
        return
    first: dict[str, Piece] = {}
    for piece in pieces:
        first.setdefault(piece.machine, piece)
    if scheduler is None:  # compile the code of a machine once
        for piece in first.values():
            yield [piece], estimates([piece])
        pieces = [piece for piece in pieces if first[piece.machine] is not piece]
    size = min(BATCH, max(1, -(-len(pieces) // (4 * jobs))))
    batches = [list(pieces[k : k + size]) for k in range(0, len(pieces), size)]
    if scheduler is None:
        yield from workers.local(estimates, batches, jobs)
    else:
        yield from workers.dask(there, batches, scheduler)


def there(batch: list[Piece]) -> list[Rows]:
    """Estimates of a batch by a remote worker. Raises UserError where the worker cannot read the recordings."""
    for piece in batch:
        if not Path(piece.folder).is_dir():
            raise UserError(
                f"a worker of the scheduler does not see {piece.folder}; recordings lie where it finds them by the "
                "same path, as on a shared disk"
            )
    return estimates(batch)


def summary(judged: Sequence[Judged], rows: Rows, least: float) -> dict[str, Any]:
    """Counts, changes and failed pieces, in the form of `--json`."""
    changes = [change_words(one, number, least) for one in judged for number in range(len(one.changes))]
    errors = {row["folder"]: row["error"] for row in rows if row["error"] is not None}
    pieces = {(row["folder"], row["first_row"]) for row in rows}
    return {
        "records": len(pieces),
        "machines": sorted({row["machine"] for row in rows}),
        "series": len(judged),
        "looked_at": sum(one.series.looked_at for one in judged),
        "changes": changes,
        "alarms": sum(change["alarm"] for change in changes),
        "errors": [{"folder": folder, "error": error} for folder, error in errors.items()],
    }


def change_words(one: Judged, number: int, least: float) -> dict[str, Any]:
    """One change of a series in plain data: kind, place, size and probability."""
    change, series = one.changes[number], one.series

    def place(k: int) -> str:
        row = series.rows[k]
        if row["at"] is None or not np.isfinite(row["at"]):
            return Path(row["folder"]).name + (f", {row['begin_s']:.0f} s" if row["first_row"] else "")
        return datetime.fromtimestamp(row["at"], UTC).isoformat(timespec="seconds")

    return {
        "machine": series.machine,
        "number": series.name,
        "of": series.kind,
        "kind": change.kind,
        "probability": round(change.probability, 4),
        "from": place(change.first),
        "folder": series.rows[change.first]["folder"],
        "between": [place(change.earliest), place(change.latest)],
        "change": round(one.share(change), 5),
        "interval": [round(float(np.expm1(change.low)), 5), round(float(np.expm1(change.high)), 5)],
        "alarm": one.alarms(change, least),
    }
