"""Folder of a campaign: plan, finished rows, and the table of all rows at the end.

campaign.json             the plan, with a hash
parts/part-000012.parquet the rows of a chunk, written atomically
results.parquet           all rows, in order of run numbers
report.html  bundles/     see rtctl.campaign.report and .keep
"""

import json
import shutil
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.campaign.plan import Plan
from rtctl.config import files
from rtctl.config.errors import UserError

CAMPAIGN, RESULTS, PARTS = "campaign.json", "results.parquet", "parts"
IDENTITY = b"campaign"  # key in the metadata of a part


class Store:
    """Folder of a running campaign. Raises UserError where it holds another campaign."""

    def __init__(self, folder: Path, plan: Plan):
        self.folder, self.plan = folder, plan
        self.schema = plan.schema.with_metadata({IDENTITY: plan.identity.encode()})
        held = folder / CAMPAIGN
        try:
            if held.exists():
                _same(folder, _read(held), plan)
            elif folder.exists() and any(folder.iterdir()):
                raise UserError(f"--out {folder}: is there already and holds no campaign; name a new folder")
            folder.mkdir(parents=True, exist_ok=True)
            _write(held, json.dumps({"hash": plan.identity, **plan.payload}, indent=1).encode())
        except OSError as error:
            raise UserError(f"--out {folder}: cannot be written: {error.strerror}") from None

    def _part(self, chunk: int) -> Path:
        return self.folder / PARTS / f"part-{chunk:06d}.parquet"

    def done(self) -> set[int]:
        """Chunks with stored rows."""
        if self.finished():
            return set(range(self.plan.chunks))
        return {chunk for chunk in range(self.plan.chunks) if self._whole(chunk)}

    def _whole(self, chunk: int) -> bool:
        """Whether the part of a chunk holds exactly its rows."""
        table = self._load(self._part(chunk))
        return table is not None and table["run"].to_pylist() == list(self.plan.numbers(chunk))

    def finished(self) -> bool:
        """Whether the table of all rows exists."""
        table = self._load(self.folder / RESULTS)
        return table is not None and len(table) == self.plan.runs

    def _load(self, path: Path) -> pa.Table | None:
        """Rows of a file of this campaign; None for a missing or damaged file, whose rows are computed again."""
        try:
            table = pq.read_table(path)
        except (OSError, pa.ArrowException):
            return None
        mine = (table.schema.metadata or {}).get(IDENTITY) == self.plan.identity.encode()
        return table if mine else None

    def add(self, chunk: int, rows: list[dict[str, Any]]) -> None:
        """Write the rows of a chunk. Raises UserError where the write fails."""
        table = pa.Table.from_pylist([self._typed(row) for row in rows], schema=self.schema)
        self._save(table, self._part(chunk))

    def _typed(self, row: dict[str, Any]) -> dict[str, Any]:
        """Row with text labels in columns of mixed types."""
        texts = (f.name for f in self.schema if pa.types.is_string(f.type))
        return {**row, **{name: _text(row[name]) for name in texts}}

    def finish(self) -> pa.Table:
        """Write the table of all parts; returns it."""
        if not self.finished():
            parts = [self._load(self._part(chunk)) for chunk in range(self.plan.chunks)]
            self._save(pa.concat_tables([part for part in parts if part is not None]), self.folder / RESULTS)
            shutil.rmtree(self.folder / PARTS, ignore_errors=True)
        return pq.read_table(self.folder / RESULTS)

    def _save(self, table: pa.Table, path: Path) -> None:
        try:
            files.made_in(self.folder, *path.parent.relative_to(self.folder).parts)
            with files.replaced(path, "wb", sync=True) as file:
                pq.write_table(table, file, compression="zstd")
        except OSError as error:
            raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


def load_results(folder: Path | str) -> tuple[Plan, pa.Table]:
    """Plan and table of a finished campaign. Raises UserError where the folder holds no finished campaign."""
    folder = Path(folder)
    if not (folder / CAMPAIGN).is_file():
        raise UserError(f"{folder}: is not the folder of a campaign, there is no {CAMPAIGN}; see rtctl campaign run")
    held = _read(folder / CAMPAIGN)
    if not (folder / RESULTS).is_file():
        raise UserError(f"{folder}: the campaign was not finished; go on with rtctl campaign run FILE --out {folder}")
    try:
        plan = Plan({key: value for key, value in held.items() if key != "hash"})
        table = pq.read_table(folder / RESULTS)
        return plan, table.select(plan.schema.names)
    except (OSError, pa.ArrowException) as error:
        raise UserError(f"{folder / RESULTS}: cannot be read as Parquet: {str(error).splitlines()[0]}") from None
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{folder / CAMPAIGN}: is damaged ({error!r:.80}); run the campaign again") from None


def _read(path: Path) -> dict[str, Any]:
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise UserError(f"{path}: cannot be read: {error}; name a new folder, or remove this one") from None
    if not isinstance(held, dict):
        raise UserError(f"{path}: holds no campaign; name a new folder, or remove this one")
    return held


def _same(folder: Path, held: dict[str, Any], plan: Plan) -> None:
    """Raise UserError with the differences where the folder holds another campaign."""
    if held.get("hash") == plan.identity:
        return
    words = {"sources": "version of rtctl", "bases": "config", "axes": "matrix"}
    differ = [words.get(key, key) for key in plan.payload if held.get(key) != plan.payload[key]]
    raise UserError(
        f"--out {folder}: holds a campaign with another {' and another '.join(differ) or 'hash'}; name a new folder"
    )


def _text(value: Any) -> str | None:
    return value if value is None or isinstance(value, str) else json.dumps(value)


def _write(path: Path, text: bytes) -> None:
    with files.replaced(path, "wb", sync=True) as file:
        file.write(text)
