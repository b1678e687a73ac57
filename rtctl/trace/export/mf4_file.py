"""ASAM MDF 4.10: one channel group whose master is the controller's clock, a channel for each signal, with its unit.

Memory: one batch of rows. During the export the rows are on disk twice.
"""

from datetime import UTC
from pathlib import Path

import numpy as np
from asammdf import MDF, Signal

from rtctl.trace.export.source import Source


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    with MDF(version="4.10", temporary_folder=path.parent) as mdf:  # not /tmp: that may be memory
        if source.started is not None:
            mdf.header.start_time = source.started.astimezone(UTC)
        for number, rows in enumerate(source.arrays()):
            t = rows.pop("t").astype(np.float64)
            if number == 0:
                first = [Signal(v, t, name=c.name, unit=c.unit, comment=c.help)
                         for c in source.columns if (v := rows.get(c.name)) is not None]  # fmt: skip
                group = mdf.append(first, acq_name=source.name, common_timebase=True)
            else:
                mdf.extend(group, [(t, None), *((values, None) for values in rows.values())])
        mdf.save(path, overwrite=True, compression=1)
