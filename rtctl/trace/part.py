"""One bundle that is being written: a stream while rows come, a Parquet file once it is finished.

At every moment in between, its folder holds all the rows in a form that `rtctl.trace.repair` understands.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.trace.bundle import ARROWS, PARQUET, as_json, part_folders, save_case, write_parquet
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
