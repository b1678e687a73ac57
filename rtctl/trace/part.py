"""Part: writer of one bundle, as a stream during the recording and as a Parquet file at the end.

At every moment `rtctl.trace.repair` can rebuild the bundle, with all rows, from the folder.
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
    """Writer of rows into `folder`; the case is on disk before the first row. Raises OSError where a write fails."""

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
        """Append `rows` (structured array), unbuffered; returns the number written. Raises OSError once."""
        return self._writer.write(rows)

    def look(self) -> str | None:
        """Follow a renamed folder, or rescue the rows of a deleted folder; returns a sentence about it, or None.

        Raises OSError where the rescued rows cannot be written.
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
        """Keep the stream in `folder`, which may have a new name; returns whether its rows were rescued.

        Raises OSError.
        """
        if self._writer.is_at(folder / ARROWS):
            self.folder = folder
            return False
        self.rescue(folder)
        return True

    def rescue(self, folder: Path) -> None:
        """Copy the stream into `folder` and continue there. On failure raises OSError; the part stays unchanged."""
        folder.mkdir(parents=True, exist_ok=True)
        try:
            save_case(folder, {**self.case, "complete": False})
            self._writer.move(folder / ARROWS)
        except OSError:
            with contextlib.suppress(OSError):
                (folder / CASE).unlink(missing_ok=True)
                folder.rmdir()  # fails, as it should, where the folder holds other files
            raise
        self.folder = folder

    def close(self) -> None:
        """Close the stream. Raises OSError where the end cannot be written."""
        self._writer.close()

    def finish(self, extra: Mapping[str, Any], losses: Losses, error: Exception | None) -> None:
        """Finish the bundle; `extra` goes into the case. May be called again after a failure.

        Raises OSError where the Parquet file cannot be written. The stream then stays, for `repair`.
        """
        self.case = {**self.case, **extra, "rows": self.rows, **told(losses, error)}
        reader = StreamReader(self.folder / ARROWS)
        try:
            write_parquet(self.folder, reader, self._writer.schema, expect=self.rows)
        except OSError:
            save_case(self.folder, {**self.case, "complete": False})  # `repair` does not know the losses
            raise
        save_case(self.folder, self.case)
        reader.path.unlink()  # last: a repair needs the stream until here


def told(losses: Losses, error: Exception | None) -> dict[str, Any]:
    """Entries of the case about lost rows and the error."""
    words: dict[str, Any] = {"losses": losses.as_dict(), "complete": not losses.rows and not error}
    return {**words, "recording_error": str(error)} if error else words


def refuse_taken(folder: Path) -> None:
    """Raise UserError where the folder holds a recording or parts of a recording."""
    names = [name for name in (ARROWS, PARQUET) if (folder / name).exists()]
    names += [part.name for part in part_folders(folder)[:1]]
    if names:
        raise UserError(f"{folder} already holds {names[0]}; choose another folder")
