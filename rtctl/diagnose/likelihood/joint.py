"""Likelihood of several recordings of one machine: the sum over recordings, each with its own start and noise.

Recordings share parameters and effects. Each recording has its own values of the paths under `per_recording`, and its
own state at the first row. Residuals are stacked, recording after recording, so that a fit sees one recording.

Source: Ljung, System Identification (1999), ch. 7 and 14.3 for estimates from several data records.
"""

import math
from collections.abc import Sequence
from copy import copy

import numpy as np

from rtctl.case.start import is_start
from rtctl.config.errors import UserError
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.noise import Noise
from rtctl.diagnose.model.model import RECORDING, GraphModel, nominal
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.model.space import Space

SAME = 1e-9  # relative difference of two equal values, at most


class Joint(Likelihood):
    """Likelihoods of several recordings as one; the first recording has the longest travel."""

    def __init__(self, parts: Sequence[Likelihood]):
        first = parts[0]
        self._parts = tuple(parts)
        self.sim, self.mean, self.rows, self.channels, self.target = (
            first.sim, first.mean, first.rows, first.channels, first.target,
        )  # fmt: skip
        self.least = np.sqrt(np.mean([part.least**2 for part in parts], axis=0))

    @property
    def parts(self) -> Sequence[Likelihood]:
        """The likelihood of each recording."""
        return self._parts

    @property
    def noise(self) -> list[Noise]:  # type: ignore[override]
        """Noise of each channel of each recording."""
        return [noise for part in self._parts for noise in part.noise]

    def raw(self, model: GraphModel, coarse: bool = False) -> np.ndarray:
        """Residuals (blocks of all recordings, sensors), SI."""
        return np.concatenate([part.raw(model, coarse) for part in self._parts])

    def plain(self, e: np.ndarray) -> np.ndarray:
        """Innovations of residuals (blocks, sensors, ...), recording after recording, with exact laws."""
        return np.concatenate([part.plain(own) for part, own in self.cut(e)])

    def noisy(self, e: np.ndarray) -> "Joint":
        """Likelihood with the noise of the residuals e (blocks, sensors)."""
        return self._of([part.noisy(own) for part, own in self.cut(e)], self.errors)

    def flat(self, e: np.ndarray) -> "Joint":
        """Likelihood with white noise of the standard deviation of the residuals e (blocks, sensors), by recording."""
        return self._of([part.flat(own) for part, own in self.cut(e)], self.errors)

    def directed(self, model: GraphModel) -> "Joint":
        """Likelihood with the sensors that show no direction, where the model gives directions in every recording."""
        sims = [part.sim.directed(model) for part in self._parts]
        for sim in sims:
            sim.channels = [name for name in sim.channels if all(name in other.channels for other in sims)]
        return Joint([Likelihood(sim) for sim in sims])

    def following(self, times: float) -> "Joint":
        """Likelihood of these rows with observers of `times` the bandwidth, and with exact laws."""
        return self._of([part.following(times) for part in self._parts]).described(None)

    def parted(self, e: np.ndarray, count: int) -> np.ndarray:
        """Losses (count,) by segment, nats, with exact laws; each recording has a share of the segments."""
        cuts = self.cut(e)
        shares = np.cumsum([len(own) for _, own in cuts]) * count // sum(len(own) for _, own in cuts)
        sizes = np.maximum(np.diff([0, *shares]), 1)
        found = np.concatenate([part.parted(own, int(n)) for (part, own), n in zip(cuts, sizes, strict=True)])
        out = found[:count]
        out[-1] += found[count:].sum()
        return out

    @property
    def size(self) -> int:
        """Number of innovations."""
        return sum(part.size for part in self._parts)

    @property
    def spread(self) -> np.ndarray:
        """Standard deviation of each channel, the mean over the recordings, SI."""
        return np.asarray(np.sqrt(np.mean([part.spread**2 for part in self._parts], axis=0)))

    def split(self, share: float) -> tuple["Joint", "Joint"]:
        """Likelihoods of the first rows, and of the last `share` of the rows, of each recording."""
        halves = [part.split(share) for part in self._parts]
        early, late = (self._of(side).described(None) for side in zip(*halves, strict=True))
        return early, late

    def during(self, begin: int, end: int) -> "Joint":
        """Likelihood of rows `begin` to `end` of each recording."""
        return self._of([part.during(begin, min(end, part.rows[1])) for part in self._parts]).described(None)

    def _of(self, parts: Sequence[Likelihood], errors: np.ndarray | None = None) -> "Joint":
        other = copy(self)
        other._parts, other.errors, other._slack = tuple(parts), errors, None
        other.rows = parts[0].rows
        return other

    def cut(self, e: np.ndarray) -> list[tuple[Likelihood, np.ndarray]]:
        """Likelihood of each recording, with its part of the residuals e (blocks, ...)."""
        sizes = [(part.rows[1] - part.rows[0]) // part.mean for part in self._parts]
        return list(zip(self._parts, np.split(e, np.cumsum(sizes)[:-1]), strict=True))


def together(records: Sequence[GraphRecord]) -> tuple[Likelihood, Space]:
    """Likelihood and unknowns of the recordings of one machine.

    Raises UserError where the machines differ, or where a value differs that no recording declares under
    `per_recording`.
    """
    if len(records) == 1:
        case = records[0].case
        return Likelihood(Simulator(records[0])), Space(nominal(case), case.fitted, case.tolerance)
    records = named(records)
    first = records[0]
    differ = {path for record in records for path in record.case.per_recording}
    for other in records[1:]:
        check_same(first, other)
        _check_values(first, other, differ)
    own = [path for path in first.case.values if path in differ or is_start(path)]
    model = nominal(first.case)
    base = dict(model.base)
    for record in records:
        base |= {f"{path}{RECORDING}{record.name}": record.case.values[path] for path in own}
    cases = {record.name: record.case for record in records}
    names = [path for path in first.case.fitted if path not in own]
    names += [f"{p}{RECORDING}{name}" for name, case in cases.items() for p in case.fitted if p in own]

    def tolerance(path: str) -> float:
        plain, _, name = path.partition(RECORDING)
        return cases.get(name, first.case).tolerance(plain)

    like = Joint([Likelihood(Simulator(record)) for record in records])
    return like, Space(model._replace(base=base), tuple(names), tolerance)


def named(records: Sequence[GraphRecord]) -> list[GraphRecord]:
    """Recordings with unique names, the longest travel first."""
    out: list[GraphRecord] = []
    for record in sorted(records, key=lambda r: -float(np.ptp(r.y[r.main]))):
        name = record.case.file.parent.name
        taken = {other.name for other in out}
        number = next(n for n in range(1, len(records) + 1) if (name if n == 1 else f"{name}-{n}") not in taken)
        out.append(record._replace(name=name if number == 1 else f"{name}-{number}"))
    return out


def check_same(first: GraphRecord, second: GraphRecord) -> None:
    """Raise UserError where two records are of machines with other elements."""
    for group in ("bodies", "joints", "drives", "sensors"):
        one, two = (set(getattr(r.case.machine, group)) for r in (first, second))
        if one != two:
            raise UserError(
                f"{second.case.file}: machine.{group} has {', '.join(sorted(two)) or 'none'}, and the first recording "
                f"has {', '.join(sorted(one)) or 'none'}; both recordings need the same machine"
            )
    if list(first.y) != list(second.y):
        raise UserError(
            f"{second.case.file}: the recording shows {', '.join(second.y)}, and the first {', '.join(first.y)}; "
            "both recordings need the same sensors"
        )


def _check_values(first: GraphRecord, other: GraphRecord, differ: set[str]) -> None:
    """Raise UserError where two cases differ in the problem, or in a value that they share."""
    if first.case.problem != other.case.problem:
        raise UserError(
            f"{other.case.file}: problem is {other.case.problem}, and {first.case.problem} in {first.case.file}; "
            "recordings that are diagnosed together need the same problem"
        )
    one, two = first.case.values, other.case.values
    for path in {**one, **two}:
        if path in differ or is_start(path) or path in first.case.made:
            continue
        a, b = one.get(path, 0.0), two.get(path, 0.0)
        if not math.isclose(a, b, rel_tol=SAME):
            raise UserError(
                f"{other.case.file}: {path} is {b:g}, and {a:g} in {first.case.file}; write per_recording: [{path}] "
                "into both if the value differs between recordings, else the same value"
            )
