"""Recovery of the rows that a killed daemon left in shared memory: `rtctl trace recover NAME`.

The segment of a dead daemon is renamed under the machine's lock, so that the next start does not wait. A segment is
removed once its rows are on the disk.
"""

import re
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from rtctl.config.errors import UserError, nearest
from rtctl.daemon import leftover, shared_memory
from rtctl.daemon.lock import MachineLock
from rtctl.trace import join

NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")


class Recovered(NamedTuple):
    """Result of the recovery of one segment."""

    segment: Path  # removed
    bundle: Path | None  # bundle with the recovered rows; None where there was no row
    rows: int  # recovered rows
    ticks: tuple[int, int] | None  # first and last recovered tick
    lost: int  # rows in neither the segment nor the recording
    alone: str | None  # reason for a separate bundle

    def __str__(self) -> str:
        if self.ticks is None:
            lacks = "no rows in this segment" if self.bundle is None else f"{self.bundle} already has all its rows"
            return f"{self.segment}: {lacks}; removed"
        own = f", in a separate bundle ({self.alone})" if self.alone else ""
        lost = f"{self.lost} rows are lost" if self.lost else "none is lost"
        return f"{self.bundle}: {self.rows} rows recovered, ticks {self.ticks[0]} to {self.ticks[1]}, {lost}{own}"


def recover(name: str, out: Path | None = None) -> tuple[list[Recovered], list[str]]:
    """Join the rows of all segments of a machine to their recordings. Returns the recovered segments and the failures.

    `out` is the folder of a moved recording, or a new folder for rows without one; default NAME-recovered-DATE-TIME.
    Raises UserError where there is no segment, or only the segment of a running daemon.
    """
    if not NAME.fullmatch(name):
        raise UserError(f"'{name}' is no name of a machine; use letters, digits, '_' and '-', at most 40 characters")
    running: UserError | None = None
    try:
        with MachineLock(shared_memory.lock_path(name), name):
            shared_memory.put_aside(name, most=None)
    except UserError as error:
        running = error
    left = shared_memory.kept(name)
    if not left:
        raise running or _nothing(name)
    done, troubles = [], []
    for segment in left:
        try:
            done.append(_segment(name, segment, out))
        except UserError as error:
            troubles.append(f"{error}; {segment} is kept")
        except OSError as error:
            troubles.append(f"the rows of {segment} cannot be written: {error.strerror or error}; the segment is kept")
    return done, troubles


def _segment(name: str, path: Path, out: Path | None) -> Recovered:
    with leftover.opened(path) as left:
        found = _bundle(left, out)
        if not len(left.rows) and found is None:
            done, why = None, None
        elif found is not None:
            done, why = join.join(found, left.rows, left.columns, left.case), None
        else:
            why = (
                "the run was not recorded" if left.bundle is None else f"its recording is not at {left.bundle} any more"
            )
            done = join.alone(_free(name, path, out), left.rows, left.columns, left.case)
        shared_memory.remove(path)  # the rows are on the disk
    if done is None:
        return Recovered(path, None, 0, None, 0, None)
    ticks = None if done.first is None or done.last is None else (done.first, done.last)
    return Recovered(path, done.folder, done.rows, ticks, done.lost, why)


def _bundle(left: leftover.Leftover, out: Path | None) -> Path | None:
    """Folder of the recording of the segment's run; None where there is none."""
    return next((place for place in (left.bundle, out) if place is not None and join.is_of(place, left.case)), None)


def _free(name: str, path: Path, out: Path | None) -> Path:
    """Path of a new or empty folder for the recovered rows."""
    when = datetime.fromtimestamp(path.stat().st_mtime).strftime("%Y%m%d-%H%M%S")
    base = out if out is not None else Path(f"{name}-recovered-{when}")
    folder, number = base, 2
    while folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        folder, number = base.with_name(f"{base.name}-{number}"), number + 1
    return folder


def _nothing(name: str) -> UserError:
    """Error for a machine without a segment."""
    others = [other for other in shared_memory.names() if other != name]
    meant = nearest(name, others)
    hint = f"; did you mean '{meant}'?" if meant else f"; there is {', '.join(others)}" if others else ""
    where = shared_memory.shared_folder()
    return UserError(f"no rows of a killed '{name}' are in {where}, the shared memory of this user{hint}")
