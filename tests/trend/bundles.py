"""Bundles of a carriage on a rail, driven by a force in open loop, with the friction and mass of the test."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.signal import lfilter

MASS, VISCOUS = 2.0, 8.0  # kg, Ns/m
COUNT = 1e-6  # m
BEGAN = datetime(2025, 3, 1, 6, 0, tzinfo=UTC)


def bundle(
    folder: Path,
    number: int = 0,
    seconds: float = 4.0,
    viscous: float = VISCOUS,
    mass: float = MASS,
    rate: float = 500.0,
    group: str = "rail",
    dated: bool = True,
    row_group: int = 65_536,
) -> Path:
    """Recording of the carriage under a random force of a few hertz; `number` is the seed and the day."""
    rng = np.random.default_rng(number)
    n, dt = int(seconds * rate), 1.0 / rate
    smooth = np.exp(-dt / 0.05)
    force = (
        40.0 * lfilter([1.0 - smooth], [1.0, -smooth], rng.standard_normal(n)) / np.sqrt((1 - smooth) / (1 + smooth))
    )
    pole = np.exp(-viscous / mass * dt)
    speed = lfilter([0.0, (1.0 - pole) / viscous], [1.0, -pole], force)
    lag = mass / viscous  # position from speed and force, held over a tick: exact
    x = np.cumsum(
        np.concatenate([[0.0], lag * (1.0 - pole) * speed[:-1] + (dt - lag * (1.0 - pole)) / viscous * force[:-1]])
    )
    columns = {
        "t": dt * np.arange(n),
        "u": force,
        "x": COUNT * np.round((x + 2.0 * COUNT * rng.standard_normal(n)) / COUNT),
    }
    folder.mkdir(parents=True)
    pq.write_table(pa.table(columns), folder / "recording.parquet", row_group_size=row_group)
    case = {
        "format": 2, "sample_rate": rate, "delay_samples": 0.0, "group": group,
        "machine": {
            "bodies": {"carriage": {"mass": MASS, "viscous": VISCOUS}},
            "drives": {"drive": {"body": "carriage", "column": "u", "unit": "N", "kind": "force", "gain": 1.0}},
            "sensors": {"scale": {"body": "carriage", "measures": "position", "column": "x", "resolution": COUNT}},
        },
        "tolerance": {"default": 0.3, "drives.drive.gain": 0.0},
        "controller": {"kind": "none"},
    }  # fmt: skip
    if dated:
        case["recorded_at"] = (BEGAN + timedelta(days=number)).isoformat()
    (folder / "case.json").write_text(json.dumps(case))
    return folder


def worn(folder: Path, count: int = 24, since: int = 14, viscous: float = 1.25 * VISCOUS) -> Path:
    """Folder of daily recordings with viscous friction `viscous` from recording `since` on."""
    for number in range(count):
        bundle(folder / f"day-{number:03d}", number, 3.0, viscous if number >= since else VISCOUS)
    return folder
