"""Reader of ASAM MDF, versions 3 and 4, with asammdf: a column for each channel; the master channel is the clock.

Channel groups with a common clock are joined. With several clocks a column is `group/name`.
"""

import gc
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from asammdf import MDF

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.nested import notes_of, unit_text
from rtctl.trace.imports.table import Table

TIME = "time"  # where the master has no name
TIME_MASTERS = (0, 1)  # sync types of MDF 4: none, time


class _Clock(NamedTuple):
    """Channels of groups with one master."""

    name: str  # of the first group
    master: str
    times: np.ndarray  # (n,) s
    unit: str
    groups: list[int]


def read(path: Path) -> Table:
    """The columns of all groups. Raises UserError, OSError."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None  # asammdf's destructor fails after a failed open
    try:
        with MDF(path) as mdf:
            refuse_large(path, sum(_size(group) for group in mdf.groups), "its channels")
            return _table(path, mdf)
    except (OSError, UserError):
        raise
    except Exception:  # asammdf raises any type for a damaged file
        pass  # raising below frees the reader, which this traceback holds
    finally:
        gc.collect()
        sys.unraisablehook = hook
    raise UserError(f"{path} cannot be read as MDF: it is damaged or cut off; save it again")


def _size(group: Any) -> int:
    record, channels = group.channel_group, len(group.channels)
    return int(record.cycles_nr) * max(int(record.samples_byte_nr), 8 * (channels + 1))


def _table(path: Path, mdf: Any) -> Table:
    clocks = _clocks(mdf)
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    left: dict[str, str] = {}
    for clock in clocks:
        before = f"{clock.name}/" if len(clocks) > 1 else ""
        columns[before + clock.master], units[before + clock.master] = clock.times, clock.unit
        for number in clock.groups:
            for index, channel in enumerate(mdf.groups[number].channels):
                if index == mdf.masters_db.get(number):
                    continue
                name = before + channel.name
                name = name if name not in columns and name not in left else f"{name} ({number}.{index})"
                values, unit, why = _channel(mdf, number, index, len(clock.times))
                if values is None:
                    left[name] = why
                    continue
                columns[name] = values
                if unit:
                    units[name] = unit_text(unit)
    single = clocks[0].master if len(clocks) == 1 and clocks[0].unit == "s" else ""
    notes = notes_of(left)
    if len(clocks) > 1:
        told = ", ".join(f"{clock.name} ({len(clock.times)} rows)" for clock in clocks[:6])
        notes = (f"its channel groups have clocks of their own: {told}; map columns of one group", *notes)
    return Table(path, columns, units, clock=single, notes=notes, left=left)


def _clocks(mdf: Any) -> list[_Clock]:
    """Clocks: channel groups joined by equal times of their master."""
    found: list[_Clock] = []
    for number, group in enumerate(mdf.groups):
        if not group.channels:
            continue
        times = np.asarray(mdf.get_master(number), float)
        for clock in found:
            if len(clock.times) == len(times) and np.array_equal(clock.times, times):
                clock.groups.append(number)
                break
        else:
            index = mdf.masters_db.get(number)
            master = group.channels[index] if index is not None else None
            timed = master is None or getattr(master, "sync_type", 1) in TIME_MASTERS
            name = str(getattr(group.channel_group, "acq_name", "") or f"group{number}")
            taken = {clock.name for clock in found}
            name = name if name not in taken else f"{name}.{number}"
            unit = "s" if timed else str(getattr(master, "unit", "") or "")
            found.append(_Clock(name, master.name if master is not None else TIME, times, unit, [number]))
    return found


def _channel(mdf: Any, group: int, index: int, rows: int) -> tuple[np.ndarray | None, str, str]:
    """Converted values (n,), unit and "" of a channel; or None, "" and the reason."""
    signal = mdf.get(group=group, index=index, ignore_invalidation_bits=True)
    values = np.asarray(signal.samples)
    unit = str(signal.unit or "")
    if values.dtype.names or values.ndim != 1:
        return None, "", f"a structure or an array of shape {values.shape[1:] or '(fields)'}"
    if values.dtype.kind not in "fiubSU":
        return None, "", f"values of type {values.dtype}"
    if len(values) != rows:
        return None, "", f"{len(values)} values where its clock has {rows}"
    invalid = getattr(signal.invalidation_bits, "array", signal.invalidation_bits)
    if invalid is not None and np.any(invalid):
        if values.dtype.kind in "SU":
            return None, "", f"text with {int(np.sum(invalid))} invalid values"
        values = np.where(np.asarray(invalid, bool), np.nan, values.astype(float))
    if values.dtype.kind == "S":
        values = np.array([value.decode(errors="replace").strip("\0 ") for value in values], object)
    return values, unit, ""
