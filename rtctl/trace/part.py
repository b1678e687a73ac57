"""One bundle that is being written: a stream while rows come, a Parquet file once it is finished.

At every moment in between, its folder holds all the rows in a form that `rtctl.trace.repair` understands.
"""

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.trace import moved
from rtctl.trace.bundle import ARROWS, CASE, PARQUET, as_json, part_folders, save_case, write_parquet
from rtctl.trace.columns import Column
from rtctl.trace.losses import Losses
from rtctl.trace.stream import StreamReader, StreamWriter


class Part:
    """Writes rows into `folder`, with the case on disk before the first of them. Raises OSError where it cannot."""

    def __init__(self, folder: Path, columns: Sequence[Column], dtype: np.dtype, case: Mapping[str, Any]):
        refuse_taken(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.case = dict(case)
        save_case(folder, {**case, "complete": False})
        self._writer = StreamWriter(folder / ARROWS, columns, dtype, {"case": as_json(self.case)})

    @property
    def rows(self) -> int:
        return self._writer.rows

    @property
    def bytes(self) -> int:
        return self._writer.bytes

    def write(self, rows: np.ndarray) -> int:
        """Append `rows` (structured array); they are with the operating system on return. Raises OSError once."""
        return self._writer.write(rows)

    def look(self) -> str | None:
        """Follow a folder that was renamed, rescue the rows of one that was deleted; a sentence about it, or None.

        Raises OSError where the disk does not take the rescued rows.
        """
        if self._writer.is_at(self.folder / ARROWS):
            return None
        before, now = self.folder, self._writer.place()
        if now is not None and now.name == ARROWS:
            self.folder = now.parent
            return f"{before} was renamed while it was recorded: the recording is now {self.folder}"
        self.rescue(moved.beside(before))
        return f"{before / ARROWS} was deleted while it was recorded: its rows are rescued into {self.folder}"

    def follow(self, folder: Path) -> bool:
        """See that the stream is in `folder`, which may have a new name; returns whether its rows had to be rescued.

        Raises OSError.
        """
        if self._writer.is_at(folder / ARROWS):
            self.folder = folder
            return False
        self.rescue(folder)
        return True

    def rescue(self, folder: Path) -> None:
        """Copy the stream into `folder` and go on there. Raises OSError; the part stays as it is then."""
        folder.mkdir(parents=True, exist_ok=True)
        try:
            save_case(folder, {**self.case, "complete": False})
            self._writer.move(folder / ARROWS)
        except OSError:
            with contextlib.suppress(OSError):
                (folder / CASE).unlink(missing_ok=True)
                folder.rmdir()  # not with somebody else's files in it
            raise
        self.folder = folder

    def close(self) -> None:
        """No more rows. Raises OSError where the disk does not take the end."""
        self._writer.close()

    def finish(self, extra: Mapping[str, Any], losses: Losses, error: Exception | None) -> None:
        """Make the bundle; `extra` goes into the case. May be called again after it has failed.

        Raises OSError where the disk does not take the Parquet file; the stream then stays, for `repair`.
        """
        self.case = {**self.case, **extra, "rows": self.rows, **told(losses, error)}
        reader = StreamReader(self.folder / ARROWS)
        try:
            write_parquet(self.folder, reader, self._writer.schema, expect=self.rows)
        except OSError:
            save_case(self.folder, {**self.case, "complete": False})  # the losses are known only here
            raise
        save_case(self.folder, self.case)
        reader.path.unlink()  # last: until now everything can be made from it


def told(losses: Losses, error: Exception | None) -> dict[str, Any]:
    """What a case says of rows that are missing."""
    words: dict[str, Any] = {"losses": losses.as_dict(), "complete": not losses.rows and not error}
    return {**words, "recording_error": str(error)} if error else words


def refuse_taken(folder: Path) -> None:
    """Raises UserError where the folder holds a recording, or a part of one."""
    names = [name for name in (ARROWS, PARQUET) if (folder / name).exists()]
    names += [part.name for part in part_folders(folder)[:1]]
    if names:
        raise UserError(f"{folder} already holds {names[0]}; choose another folder")
