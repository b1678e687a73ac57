"""Reader of NI TDMS with npTDMS: a column for each channel, with its unit; `group/channel` with several groups.

Waveform channels have a start and an increment. Without a channel `t`, their clock is the column `wf_time`.
"""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsFile

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.nested import notes_of, unit_text
from rtctl.trace.imports.table import Table

TIME = "wf_time"
UNITS = ("unit_string", "NI_UnitDescription", "unit", "units", "Unit")


def read(path: Path) -> Table:
    """The columns of all groups. Raises UserError, OSError."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with path.open("rb") as source, TdmsFile.open(source) as file:
                return _table(path, file)
    except (OSError, UserError):
        raise
    except Exception:  # npTDMS raises any type for a damaged file
        raise UserError(f"{path} cannot be read as TDMS: it is damaged or of another kind; save it again") from None


def _table(path: Path, file: Any) -> Table:
    channels = [channel for group in file.groups() for channel in group.channels()]
    refuse_large(path, sum(len(channel) * max(_width(channel), 8) for channel in channels), "its channels")
    several = len({channel.group_name for channel in channels}) > 1
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    left: dict[str, str] = {}
    clocks: dict[tuple[float, float, int], list[str]] = {}
    for channel in channels:
        name = f"{channel.group_name}/{channel.name}" if several else channel.name
        values = np.asarray(channel[:]) if len(channel) else np.empty(0)
        if not len(values) or values.dtype.kind not in "fiubMmOSU":
            left[name] = f"values of type {values.dtype}" if len(values) else "empty"
            continue
        columns[name] = values
        unit = next((channel.properties[key] for key in UNITS if channel.properties.get(key)), None)
        if unit is not None and values.dtype.kind not in "Mm":
            units[name] = unit_text(str(unit))
        step = channel.properties.get("wf_increment")
        if isinstance(step, int | float) and step > 0:
            start = float(channel.properties.get("wf_start_offset") or 0.0)
            clocks.setdefault((float(step), start, len(values)), []).append(name)
    notes = list(notes_of(left))
    status = getattr(file, "file_status", None)
    if getattr(status, "incomplete_final_segment", False):
        notes.append("the file is cut off: the values that are whole are taken")
    clock = _clock(columns, units, clocks, notes)
    return Table(path, columns, units, clock=clock, notes=tuple(notes), left=left)


def _clock(columns: dict[str, np.ndarray], units: dict[str, str], clocks: dict, notes: list[str]) -> str:
    """Name of the time column. Without a channel `t`, adds a time column for each increment."""
    if "t" in columns or not clocks:
        return ""
    for (step, start, rows), names in clocks.items():
        name = TIME if len(clocks) == 1 else f"{names[0]}.{TIME}"
        columns[name], units[name] = start + step * np.arange(rows), "s"
    if len(clocks) == 1:
        return TIME
    told = ", ".join(f"{names[0]} {1 / step:g} Hz ({rows} rows)" for (step, _, rows), names in list(clocks.items())[:6])
    notes.append(f"its channels have clocks of their own: {told}; map channels of one clock, with t=NAME.{TIME}")
    return ""


def _width(channel: Any) -> int:
    return int(getattr(channel.dtype, "itemsize", 8) or 8)
