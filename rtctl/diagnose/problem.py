"""A recording as a fit sees it: the errors of a simulation that follows it, what they weigh, what noise leaves of them.

Source: Ljung, System Identification (1999), ch. 7 for the prediction error in closed loop.
"""

from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from rtctl.diagnose.case import Case, believed
from rtctl.diagnose.edges import Edges, alike, edges
from rtctl.diagnose.hiss import commanded, is_hiss
from rtctl.diagnose.kernel import TRACK
from rtctl.diagnose.model import Model
from rtctl.diagnose.rest import averaged, shares
from rtctl.diagnose.simulate import Simulator, resolution
from rtctl.diagnose.stretches import loudness, rms

if TYPE_CHECKING:
    from rtctl.diagnose.white import White

EDGE = 0.6  # of an edge's sigma, on quiet machines
EDGES = 0.5  # share of the main sensor's rows that all edges count for: they are few, but each is worth many rows
FLOOR = {"capstan_counts": 0.86, "encoder_counts": 0.9, "scale_counts": 0.9}  # of SIGMA, on quiet machines
RECTIFIED = ("reel1_counts", "reel2_counts")
FINEST = 1.8  # floor of a position in m or rad, whose SIGMA is half its resolution: stops are never quite hard
LOUDEST = {"ivu": 20.0, "ldu": 20.0, "axis": 80.0}  # times the floor, of what random forces leave
ADDED = 2.0  # the same by what a white force adds up to, of a speed
EXACTLY = {"ivu": 2.5, "ldu": 2.5, "axis": 12.0}  # times the floor, beyond which that has to have their very pattern
SHAKEN = 2.5  # times EDGE: what random forces do to the reels at most, which follow the capstan however that is shaken
PARTED = 2.5  # times the floor, by which one sensor may differ from what another shows of the same motion
GIVES = 0.2  # share of that motion by which it may differ besides: springs lie between the two
FORGOTTEN = 4.0  # over the bandwidth of the correction: the time after which errors no longer go together
FORGET = 8.0  # the same, after which it does not show how the machine stood before the recording
TOGETHER = 100.0  # errors that count as one
SIGMA = {"encoder": 0.4, "scale": 0.5}  # counts: what quantisation and a quiet machine leave


class Problem:
    """A recording, how its errors are weighed, and the rows that count.

    Errors are those of the sensors that know direction, averaged over `mean` ticks, sensor by sensor, and between them,
    in the order of time, those of the edges that reels were seen at.
    """

    together = TOGETHER

    def __init__(
        self,
        sim: Simulator,
        stop: int | None = None,
        channels: Sequence[int] | None = None,
        mean: int | None = None,
        edges: Sequence[Edges] = (),
    ):
        self.sim = sim
        self.rows = slice(settled(sim), stop)
        self.mean = averaged(sim.record.dt) if mean is None else mean  # ticks averaged into one error
        self.channels = list(channels if channels is not None else main_channels(sim))
        seen = np.stack([sim.record.y[sim.channels[c]] + sim.half for c in self.channels], axis=1)
        self.target = means(seen[self.rows], self.mean)
        self.sigma = np.array([_sigma(sim, c) for c in self.channels])
        self.n = len(seen) if stop is None else stop
        self.edges = tuple(e.between(self.rows.start, self.n) for e in edges)
        ticks = np.tile(self.rows.start + self.mean * np.arange(len(self.target)), len(self.channels))
        rows = np.concatenate([ticks, *(e.rows for e in self.edges)])
        self.order = np.argsort(rows, kind="stable") if self.edges else np.arange(len(rows))
        self.time_rows = rows[self.order]  # of each error
        sizes = [len(self.target)] * len(self.channels) + [len(e.rows) for e in self.edges]
        self.source = np.repeat(np.arange(len(sizes)), sizes)[self.order]  # number of the sensor that it is of
        few = sum(len(e.rows) for e in self.edges)
        self.balance = float(np.sqrt(EDGES * len(self.target) / few)) if few else 1.0  # what an edge counts for
        grain = resolution(sim.record) if sim.record.plant == "axis" else 1.0
        memory = self.block * self.mean
        gone = np.cumsum(sim.seen) / memory if sim.record.shows_speed else sim.seen  # a stop is where it gets nowhere
        share = shares(gone[: self.n], grain, memory)[self.time_rows]
        self.moves = share == 1.0  # (errors,): the machine does
        self.weights = np.sqrt(share / share.mean())
        self.clock = np.ones(len(rows))  # (errors,): share of the weights, for what ticks off their times make
        self.louder = 1.0  # than a quiet machine, as far as is known
        self.measured = sim.record.shows_speed  # the floor is the noise of this very record
        self.white: White | None = None  # the same with white errors, in which names are weighed

    def seen_by(self, model: Model) -> "Problem":
        """The same with the edges of counters that cannot tell direction, which the model tells; there must be no
        weights yet."""
        stop = None if self.n == len(self.sim.seen) else self.n
        return Problem(self.sim, stop, self.channels, self.mean, self._told(model))

    def agrees(self, model: Model) -> bool:
        """Whether the model tells the directions of the reels' counts as they were taken."""
        return alike([e.between(self.rows.start, self.n) for e in self._told(model)], self.edges)

    def _told(self, model: Model) -> list[Edges]:
        """The reels' edges of the whole record as the model tells their directions, where it does."""
        names = {c: name for c, name in enumerate(self.sim.channels) if name in RECTIFIED}
        out = self.sim.run(model, directed=True) if names else np.empty((0, 0))
        found = []
        for c, name in names.items():  # a reel follows the capstan that was seen, not the one that was simulated
            gear = float(np.polyfit(out[:, 0], out[:, c], 1)[0]) if np.isfinite(out).all() else np.nan
            found.append(edges(self.sim.record.y[name], out[:, c] + gear * (self.sim.seen - out[:, 0]), c))
        return [e for e in found if e is not None]

    def of(self, sim: Simulator) -> "Problem":
        """The same of another simulator of the recording."""
        other = copy(self)
        other.sim = sim
        return other

    def pushed_behind(self) -> "Problem":
        """The same with every model corrected as one whose contact slips is."""
        return self.of(self.sim.pushed_behind())

    def weighed_in(self, white: "White | None") -> "Problem":
        """The same, in which names are weighed by the errors of `white`, or else by its own."""
        other = copy(self)
        other.white = white
        return other

    def weighed(self, weights: np.ndarray) -> "Problem":
        """The same with a further weight for each error."""
        other = copy(self)
        other.weights = self.weights * weights
        return other

    def allowing(self, weights: np.ndarray) -> "Problem":
        """As `weighed`, for the noise of ticks off their times."""
        other = self.weighed(weights)
        other.clock = self.clock * weights
        return other

    @property
    def main_floor(self) -> float:
        """Weighted rms of the error where nothing is missing, of the sensors that know direction: what counts leave,
        and a machine that is never quiet."""
        share = [FLOOR.get(self.sim.channels[c], 0.0) for c in self.channels]
        if not any(share):
            return FINEST * self.louder
        mean = 0.62 if self.mean > 1 else 1.0
        return self.louder * mean * rms(np.array(share))

    @property
    def floor(self) -> float:
        """The same of all errors."""
        known = len(self.target) * len(self.channels)
        power = known * self.main_floor**2 + (len(self.order) - known) * (EDGE * self.balance * self.louder) ** 2
        return float(np.sqrt(power / len(self.order)))

    def error(self, model: Model, coarse: bool = False) -> np.ndarray:
        """Readings less simulation by their noise (rows, channels), without a constant offset of a second sensor."""
        return self._error(self.sim.run(model, TRACK, self.n, coarse))

    def _error(self, out: np.ndarray) -> np.ndarray:
        e = (self.target - means(out[:, self.channels][self.rows], self.mean)) / self.sigma
        e[:, 1:] -= e[:, 1:].mean(axis=0)
        return e

    def residual(self, model: Model, coarse: bool = False, at: str = "") -> np.ndarray:
        """All errors as one row of numbers; 1e6 where the model runs away. `at`: the body that is pushed to keep it on
        track, in place of the drives."""
        out = self.sim.run(model, TRACK, self.n, coarse, directed=bool(self.edges), at=at)
        e = np.concatenate([self._error(out).T.ravel(), *(self.balance * reel.error(out) for reel in self.edges)])
        return np.nan_to_num(e, nan=1e6, posinf=1e6, neginf=-1e6).clip(-1e6, 1e6)[self.order] * self.weights

    def beside(self, values: np.ndarray) -> np.ndarray:
        """Values of the sensors that know direction, sensor by sensor, in the order of the errors; 0 for edges."""
        return np.concatenate([values, np.zeros(len(self.order) - len(values))])[self.order]

    def by_sensor(self, r: np.ndarray) -> dict[str, np.ndarray]:
        """The errors of a residual r by the sensor they are of, in the order of time; the main one is first."""
        scales = [1.0] * len(self.channels) + [self.balance] * len(self.edges)
        names = [self.sim.channels[c] for c in (*self.channels, *(reel.channel for reel in self.edges))]
        return {name: r[self.source == i] / scale for i, (name, scale) in enumerate(zip(names, scales, strict=True))}

    def loudness(self, r: np.ndarray) -> np.ndarray:
        """Rms of the errors of a residual r in the stretch that each lies in, sensor by sensor."""
        out = np.empty_like(r)
        for sensor in np.unique(self.source):
            out[self.source == sensor] = loudness(r[self.source == sensor])
        return out

    def at_rows(self, channel: str, errors: np.ndarray) -> np.ndarray:
        """The errors of a sensor at the rows of those that know direction, where they are of edges."""
        for reel in self.edges:
            if self.sim.channels[reel.channel] == channel:
                rows = self.rows.start + self.mean * np.arange(len(self.target))
                return np.interp(rows, reel.rows, errors)
        return errors

    @property
    def block(self) -> int:
        """Errors after which a model on track has forgotten."""
        return max(2, round(FORGOTTEN / (self.sim.follow * self.sim.record.dt * self.mean)))

    @property
    def loudest(self) -> float:
        """Times the floor, of what random forces leave. Where the floor is the record's own they are in it, and what
        they do from one row to the next adds up for as long as the correction remembers."""
        if not self.measured:
            return LOUDEST[self.sim.record.plant]
        return ADDED / float(np.sqrt(2.8 * self.sim.follow * self.sim.record.dt * self.mean))

    def commanded(self, r: np.ndarray) -> bool:
        """Whether the command of a machine without a controller foretells the main sensor's errors in r."""
        if self.sim.case.controller.kind != "none":
            return False
        u = means(self.sim.record.u[self.rows], self.mean)
        return commanded(self.by_sensor(r)[self.sim.channels[0]], np.column_stack((u, np.abs(u))), self.block)

    def parted(self, r: np.ndarray) -> bool:
        """Whether the errors r of sensors that know direction are not of one motion: what moves the machine, random
        forces too, is seen by each of them. Where each began to count says nothing."""
        main, *others = (e - e.mean() for e in list(self.by_sensor(r).values())[: len(self.channels)])
        alone = ((e, e - main * float(main @ e) / max(float(main @ main), 1e-300)) for e in others)
        return any(rms(apart) > np.hypot(PARTED * self.main_floor, GIVES * rms(e)) for e, apart in alone)

    def hiss(self, r: np.ndarray) -> bool:
        """Whether the errors r of a fit are what random forces leave: these know nothing of what a clock makes worth
        less where it moves fast, and have their spectrum without such weights."""
        main, *others = self.by_sensor(r).values()
        moves = self.moves[self.source == 0]
        counts = moves if moves.any() else slice(None)
        main, clock = main[counts], self.clock[self.source == 0][counts]
        loud = rms(main) / self.main_floor
        if (
            loud > self.loudest
            or self.parted(r)
            or any(rms(e) > SHAKEN * EDGE for e in others[len(self.channels) - 1 :])
        ):
            return False
        exact = loud > EXACTLY[self.sim.record.plant]
        dt, speed = self.sim.record.dt * self.mean, self.sim.record.shows_speed
        e, floor = main / clock, self.main_floor * rms(1.0 / clock)
        return is_hiss(e, dt, self.sim.follow, floor, exact, speed, own_of(self.sim.case)) and not self.commanded(r)


def own_of(case: Case) -> tuple[float, float]:
    """Damper (1/s) and spring (1/s^2) of an axis per unit of its inertia, as its owner has them; 0 of other machines,
    which move freely next to how fast they are corrected."""
    known = believed(case) if case.plant == "axis" else {}
    return (known["F_v"] / known["M"], known["k"] / known["M"]) if known.get("M") else (0.0, 0.0)


def means(x: np.ndarray, count: int) -> np.ndarray:
    """Means over `count` rows each, the rest left out."""
    if count == 1:
        return x
    keep = len(x) // count * count
    out = x[0:keep:count].copy()
    for k in range(1, count):
        out += x[k:keep:count]
    return out / count


def settled(sim: Simulator) -> int:
    """First row whose error counts: the machine has moved and forgotten how it stood before the recording began."""
    y = sim.seen
    moved = int(np.argmax(np.abs(y - y[0]) > 0.01 * np.ptp(y)))
    return min(moved + round(FORGET / sim.follow / sim.record.dt), len(y) // 5)


def main_channels(sim: Simulator) -> list[int]:
    """Sensors that know direction: rectified counters lose the way at every turn."""
    return [i for i, name in enumerate(sim.channels) if not name.startswith("reel")]


def _sigma(sim: Simulator, channel: int) -> float:
    name = sim.channels[channel]
    if name == "scale_counts":
        return SIGMA["scale"]
    if name.endswith("counts"):
        return SIGMA["encoder"]
    return 0.5 * resolution(sim.record)
