"""Rerun recording: an entity such as `/ivu/ref` with scalars for each signal, and a blueprint of panels by unit.

Timelines: `t`, the controller's clock as a duration, and `time`, the start of the recording plus `t`. Help and unit of
a signal are static components; `/case` is case.json. A value that was not measured is a gap.

Memory: one batch of rows.
"""

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rtctl.config.errors import UserError
from rtctl.trace.bundle import as_json
from rtctl.trace.columns import Column
from rtctl.trace.export.source import Source

T, TIME, CASE = "t", "time", "case"


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError, UserError where Rerun is switched off."""
    path.touch()  # raises OSError; rerun would only print it
    stream = rr.RecordingStream(f"rtctl_{source.name}", send_properties=True)
    stream.save(path, default_blueprint=_blueprint(source))
    stream.log(CASE, rr.TextDocument(as_json(source.case, indent=1), media_type="text/plain"), static=True)
    for column in source.columns:
        stream.log(_entity(source, column), rr.SeriesLines(names=_title(column)), static=True)
    for batch in source.batches():
        t = batch.column("t").to_numpy(zero_copy_only=False)
        nanoseconds = np.rint(t * 1e9).astype(np.int64)
        clock = rr.TimeColumn(T, duration=nanoseconds.astype("timedelta64[ns]"))
        date = rr.TimeColumn(TIME, timestamp=(source.epoch + nanoseconds).astype("datetime64[ns]"))
        for column in source.columns:
            values = batch.column(column.name).to_numpy(zero_copy_only=False).astype(float)
            stream.send_columns(_entity(source, column), [clock, date], rr.Scalars.columns(scalars=values))
    stream.flush()
    stream.disconnect()
    if not path.stat().st_size:
        raise UserError("Rerun is switched off here and writes nothing: take RERUN=off out of the environment")


def _entity(source: Source, column: Column) -> str:
    return f"/{_part(source.name)}/{_part(column.name)}"


def _part(name: str) -> str:
    """One part of an entity path, with special characters escaped by Rerun."""
    return str(rr.escape_entity_path_part(name))


def _title(column: Column) -> str:
    return f"{column.name} [{column.unit}]" if column.unit not in ("", "1") else column.name


def _blueprint(source: Source) -> Any:
    """Blueprint with a time series panel for each unit."""
    panels: dict[str, list[str]] = {}
    for column in source.columns[1:]:  # the first is the clock
        panels.setdefault("" if column.unit == "1" else column.unit, []).append(_entity(source, column))
    views = [
        rrb.TimeSeriesView(name=unit or "without a unit", origin="/", contents=[f"+ {entity}" for entity in entities])
        for unit, entities in panels.items()
    ]
    return rrb.Blueprint(rrb.Grid(*views), rrb.TimePanel(timeline=T))
