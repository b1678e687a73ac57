"""NI TDMS: one group, named as the machine, a channel for each signal, with its unit for LabVIEW and DIAdem.

With an even rate the channels are also waveforms (`wf_increment`). `t` is always a channel.

Memory: one batch of rows.
"""

from pathlib import Path
from typing import Any

import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from rtctl.trace.bundle import as_json
from rtctl.trace.columns import Column
from rtctl.trace.export.source import Source


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    root = RootObject({"name": source.name, "rtctl_case": as_json(source.case)})
    group = GroupObject(source.name, {"description": "one value for each tick"})
    with TdmsWriter(str(path)) as file:
        for number, rows in enumerate(source.arrays()):
            channels = [
                ChannelObject(source.name, c.name, _plain(rows[c.name]), {} if number else _properties(source, c))
                for c in source.columns
            ]
            file.write_segment(channels if number else [root, group, *channels])


def _properties(source: Source, column: Column) -> dict[str, Any]:
    found: dict[str, Any] = {"unit_string": column.unit, "description": column.help}
    if source.rate is None:
        return found
    found |= {"wf_increment": 1.0 / source.rate, "wf_start_offset": source.span[0], "wf_samples": 1,
              "wf_xname": "Time", "wf_xunit_string": "s"}  # fmt: skip
    if source.started is not None:
        found["wf_start_time"] = np.datetime64(source.started.replace(tzinfo=None) - source.started.utcoffset(), "us")  # type: ignore[operator]
    return found


def _plain(values: np.ndarray) -> np.ndarray:
    return values.astype(np.uint8) if values.dtype == bool else values
