"""Report of a watch to the daemon: residuals in standard deviations, missing forces, lanes for the scope."""

from typing import Any

import numpy as np

from rtctl.watch.monitor import Monitor
from rtctl.watch.words import force_unit

MOST_NOTES = 4
LANE_SECONDS = 2.0  # of the newest blocks in a report


def report(monitor: Monitor, notes: list[str], alarm: dict[str, Any] | None) -> dict[str, Any]:
    """Arguments of the op `watch`."""
    out: dict[str, Any] = {"state": monitor.state, "learned": float(monitor.learned)}
    if notes:
        out["notes"] = [note[:2000] for note in notes[-MOST_NOTES:]]
    if alarm is not None:
        out["alarm"] = alarm
    if monitor.latest is not None and monitor.observer is not None:
        out |= lanes(monitor)
    return out


def lanes(monitor: Monitor) -> dict[str, Any]:
    """Residuals and missing forces of the newest windows. A residual is in standard deviations of the slow blocks of
    the healthy machine, once its band is learned."""
    observer, batch, band = monitor.observer, monitor.latest, monitor.band
    assert observer is not None and batch is not None
    length = batch.v.shape[1]
    step = monitor.shape.slow * monitor.shape.dt
    batch = batch.some(slice(-max(1, round(LANE_SECONDS / (length * step))), None))
    at = (batch.t[:, None] - step * np.arange(length)[::-1]).ravel()
    out: dict[str, Any] = {"t": at.tolist(), "lanes": {}, "residual": {}}
    for number, one in enumerate(observer.sim.followed):
        values = batch.force[:, :, number].ravel()
        out["lanes"][f"missing_{one.body}"] = {"unit": force_unit(observer, number), "values": values.tolist()}
    if band is None:
        return out
    size = band.innovations(batch)[-1] / band.sigma
    for k, name in enumerate(band.sensors):
        blocks = batch.e[:, :, k].reshape(batch.size * length, -1).mean(axis=1) / band.slow_sigma[k]
        out["lanes"][f"residual_{name}"] = {"unit": "sigma", "values": blocks.tolist()}
        out["residual"][name] = float(size[k])
    return out
