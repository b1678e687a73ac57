"""Series of a trend: the estimates of one number of one machine in the order of time, on a logarithmic scale."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.trend.change_points import Z90, Change, changes
from rtctl.trend.estimate import PARAMETER

TOLD = 0.3  # least relative reduction of the prior variance by a recording, from which on a number is tested
LEAST = 0.02  # least relative change of a number that is alarmed
FLOOR = 1e-4  # least relative standard deviation of an estimate: rounding is no scatter
RESIDUAL_SD = 0.05  # nominal standard deviation of a residual's logarithm; the series scales it


class Series(NamedTuple):
    """Estimates of one number of one machine, in the order of time."""

    machine: str
    kind: str
    name: str
    unit: str
    rows: list[dict[str, Any]]
    told: float  # relative reduction of the prior variance, median over the pieces

    @property
    def looked_at(self) -> bool:
        """Whether the series is tested for changes: its recordings determine the number."""
        return self.told >= TOLD

    @property
    def dated(self) -> bool:
        """Whether every piece has a date."""
        return all(row["at"] is not None and np.isfinite(row["at"]) for row in self.rows)

    @property
    def at(self) -> np.ndarray:
        """Places (n,) of the pieces: s since 1970, or their numbers where some have no date."""
        return np.array([row["at"] for row in self.rows]) if self.dated else np.arange(len(self.rows), dtype=float)

    @property
    def logs(self) -> np.ndarray:
        """Logarithms (n,) of the values; of value over nominal value where the case lists it in `per_recording`."""
        value = np.array([abs(row["value"]) for row in self.rows])
        nominal = np.array([abs(row["nominal"] or 1.0) if row["own"] else 1.0 for row in self.rows])
        return np.asarray(np.log(np.maximum(value, 1e-300) / nominal))

    @property
    def sigmas(self) -> np.ndarray:
        """Standard deviations (n,) of the logarithms, by the intervals of the estimates."""
        if self.kind != PARAMETER:
            return np.full(len(self.rows), RESIDUAL_SD)
        width = np.array([(row["high"] - row["low"]) / (2.0 * Z90 * abs(row["value"])) for row in self.rows])
        return np.maximum(width, FLOOR)


class Judged(NamedTuple):
    """A series with its changes."""

    series: Series
    changes: tuple[Change, ...]
    probability: float  # that there is any change

    def share(self, change: Change) -> float:
        """Size of a change as a share of the value before it."""
        return float(np.expm1(change.size))

    def alarms(self, change: Change, least: float = LEAST) -> bool:
        """Whether the change is an alarm: the near end of its interval is at least `least`."""
        near = 0.0 if change.low < 0.0 < change.high else min(abs(change.low), abs(change.high))
        return bool(near >= np.log1p(least))


def series_of(rows: Sequence[dict[str, Any]]) -> list[Series]:
    """Series of a table's rows: by machine, parameters before residuals."""
    found: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        if row.get("error") is None:
            found.setdefault((row["machine"], row["kind"], row["name"]), []).append(row)
    out = []
    for (machine, kind, name), mine in found.items():
        dated = all(row["at"] is not None and np.isfinite(row["at"]) for row in mine)
        mine.sort(key=lambda row: (row["at"] if dated else 0.0, row["folder"], row["first_row"]))
        told = float(np.median([row["told"] for row in mine]))
        out.append(Series(machine, kind, name, mine[0]["unit"], mine, told))
    return sorted(out, key=lambda s: s.machine)


def judge(found: Sequence[Series]) -> list[Judged]:
    """Changes of each series; all tested series share the prior odds of a change."""
    count = max(sum(one.looked_at for one in found), 1)
    out = []
    for one in found:
        told, probability = changes(one.logs, one.sigmas, one.at, count) if one.looked_at else ([], 0.0)
        out.append(Judged(one, tuple(told), probability))
    return out
