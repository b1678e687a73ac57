"""Likelihood of a recording under a model: innovations of the residuals that the tracking observer leaves.

The residual of each sensor is averaged over a few ticks, made white by an autoregression (noise.py) and weighed by its
innovation. The negative logarithm of the likelihood is half the sum of squares plus n ln sigma for each sensor, so that
models compare each under a noise of its own.

Source: Ljung, System Identification (1999), ch. 7 and 16.4.
"""

from collections.abc import Sequence
from copy import copy
from functools import cached_property
from typing import Self

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.calibration import INNOVATIONS
from rtctl.diagnose.likelihood.noise import Noise, noises_of, surprise, whitened
from rtctl.diagnose.likelihood.slack import Inexact, Slack
from rtctl.diagnose.likelihood.slow import slow
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record.edges import Edges

RATE = 500.0  # 1/s, of the averaged residuals
ORDER = 20  # of the autoregression
FORGET = 8.0  # over the bandwidth of the observer: until the start is forgotten
QUANTISED = 0.29  # of a step: the least that counting leaves in a residual
SMOOTH = 9  # blocks, over which the rate of a reading is taken
EDGE = 0.03  # of a step: the least that an edge leaves, whose tick is known
WILD = 1e6  # residual of a model that runs away, in steps of noise


class Likelihood:
    """A recording, its noise and the rows that count."""

    errors: np.ndarray | None = None  # (blocks, sensors, columns) what the laws of a model may be wrong by
    odds: float = 0.0  # nats against laws that are as exact
    own: Inexact | None = None  # what the description itself may be wrong by, beside any effect
    _slack: Slack | None = None  # the same under this noise

    def __init__(self, sim: Simulator, noise: Sequence[Noise] | None = None, rows: tuple[int, int] | None = None):
        self.sim = sim
        record = sim.record
        self.mean = max(1, round(1.0 / (RATE * record.dt)))
        self.channels = [sim.column(name) for name in sim.channels]
        begin = min(settled(sim), len(record.t) // 4)
        self.rows = (begin, len(record.t)) if rows is None else rows
        self.target = np.stack([record.y[name] for name in sim.channels], axis=1)
        grain = np.array([record.grain[name] for name in sim.channels])
        smooth = np.std(np.diff(self.target, 2, axis=0), axis=0) / 10.0
        self.least = np.where(grain > 0.0, QUANTISED * grain, np.maximum(smooth, 1e-12)) / np.sqrt(self.mean)
        self.least = np.where([name in sim.edges for name in sim.channels], EDGE * grain, self.least)
        if sim.case.problem == "kinematic":  # the counts of the first position are in what follows it
            passed = np.array([sim.ratios.get(str(sensor_body(sim, name)), 0.0) for name in sim.channels])
            self.least = np.hypot(self.least, QUANTISED * record.grain[sim.main] * passed / np.sqrt(self.mean))
        self.noise: list[Noise] = list(noise) if noise is not None else [
            Noise(np.ones(1), float(max(least, 1e-300))) for least in self.least
        ]  # fmt: skip
        self.slow = slow(sim, self.channels, self.mean)

    def raw(self, model: GraphModel, coarse: bool = False) -> np.ndarray:
        """Residuals (blocks, sensors), SI, averaged over `mean` ticks.

        The constant of the followed sensor is that of a force. Where the others began to count says nothing: theirs is
        left out.
        """
        out = self.sim.run(model, n=self.rows[1], coarse=coarse)
        return self.of_readings(out)

    def rough(self, model: GraphModel) -> tuple[np.ndarray, bool]:
        """Residuals (blocks, sensors) of coarse simulations, from which differences are taken, and whether they are
        coarse: where a model runs away in twice the step, they are fine."""
        e = self.raw(model, True)
        return (self.raw(model), False) if self.ran_away(e) else (e, True)

    def of_readings(self, out: np.ndarray) -> np.ndarray:
        """The same of simulated readings (n, sensors of the machine)."""
        begin, end = self.rows
        blocks = (end - begin) // self.mean
        end = begin + blocks * self.mean
        e = np.empty((blocks, len(self.channels)))
        for c, (name, channel) in enumerate(zip(self.sim.channels, self.channels, strict=True)):
            if name in self.sim.edges:
                e[:, c] = self._by_edges(name, out, blocks)
            else:
                e[:, c] = averaged(self.target[begin:end, c] - out[begin:end, channel], self.mean)
        wild = WILD * self.least
        if not (np.abs(e) < wild).all():  # ran away: no noise explains it
            gone = ~(np.abs(e) < wild).all(axis=1)
            e[gone] = wild * np.random.default_rng(0).choice((-1.0, 1.0), (int(gone.sum()), e.shape[1]))
        beside = np.array([self._floats(name) for name in self.sim.channels])
        return np.asarray(e - np.where(beside, e.mean(axis=0), 0.0))

    def ran_away(self, e: np.ndarray) -> bool:
        """Whether residuals (blocks, sensors) are of a model that ran away."""
        return not bool((np.abs(e) < 0.5 * WILD * self.least).all())

    def _floats(self, name: str) -> bool:
        """Whether the constant of a channel says nothing and is still in its residuals."""
        if name in self.sim.edges:
            return False
        if self.sim.case.problem != "static":
            return name != self.sim.main
        return self._is_position(name)

    def _by_edges(self, name: str, out: np.ndarray, blocks: int) -> np.ndarray:
        """Residual (blocks,) of a sensor that shows edges: their mean in each block, 0 where there is none."""
        sensor = self.sim.case.machine.sensors[name]
        told, block = self.edges_in(name)
        way = sensor.scale * out
        e = told.at - told.way(way)
        mean = np.bincount(told.group, e) / np.maximum(np.bincount(told.group), 1)
        total = np.bincount(block, e - mean[told.group], blocks)[:blocks]
        return np.asarray(total / np.maximum(np.bincount(block, minlength=blocks)[:blocks], 1) / sensor.scale)

    def edges_in(self, name: str) -> tuple[Edges, np.ndarray]:
        """Edges of a sensor in the rows that count, and the block of each."""
        begin, end = self.rows
        told = self.sim.edges[name].between(begin + 1, begin + (end - begin) // self.mean * self.mean)
        return told, (told.rows - begin) // self.mean

    @cached_property
    def present(self) -> list[np.ndarray]:
        """Blocks in which each sensor shows something: all, those with an edge, or, of a force that a recorded motion
        makes, those in which it does not turn: that time is known to a row, and dry friction jumps there."""
        every = np.arange((self.rows[1] - self.rows[0]) // self.mean)
        steady = every if self.sim.held is None else np.setdiff1d(every, self._turns(self.sim.held.v))
        return [
            np.unique(self.edges_in(n)[1]) if n in self.sim.edges else every if self._is_position(n) else steady
            for n in self.sim.channels
        ]

    def _turns(self, v: np.ndarray) -> np.ndarray:
        """Blocks before and after each turn of a motion of the speed v (n,)."""
        last = np.flatnonzero(np.diff(np.sign(v)))
        return (np.concatenate([last, last + 1]) - self.rows[0]) // self.mean

    def _is_position(self, name: str) -> bool:
        """Whether a channel is the reading of a position."""
        sensors = self.sim.case.machine.sensors
        return name in sensors and sensors[name].measures == "position"

    @cached_property
    def growth(self) -> list[np.ndarray]:
        """What the variance of each sensor's residual may grow with (blocks present, columns): whether it moves, where
        it counts, and of a position the square of its rate: by it an error of time shows."""
        begin, end = self.rows
        blocks = (end - begin) // self.mean
        y = self.target[begin:end][: blocks * self.mean].reshape(blocks, self.mean, -1).mean(axis=1)
        rate = np.gradient(uniform_filter1d(y, SMOOTH, axis=0), axis=0) ** 2  # by the block
        out = []
        for c, (name, rows) in enumerate(zip(self.sim.channels, self.present, strict=True)):
            grain = self.sim.record.grain[name]
            columns = [rate[:, c] / (rate[:, c] + grain**2)] if grain > 0.0 else []
            if self._is_position(name):
                columns.append(rate[:, c])
            out.append(np.stack(columns, axis=1)[rows] if columns else np.zeros((len(rows), 0)))
        return out

    def directed(self, model: GraphModel) -> "Likelihood":
        """The same with the sensors that know no direction, as the model tells the directions of their edges."""
        return Likelihood(self.sim.directed(model))

    def following(self, times: float) -> "Likelihood":
        """The same rows with an observer that is so many `times` as quick, and laws that are exact."""
        other = self.slackened(None).described(None)
        other.sim = self.sim.following(times)
        other.slow = slow(other.sim, self.channels, self.mean)
        return other

    def white(self, e: np.ndarray) -> np.ndarray:
        """Innovations of residuals (blocks, sensors, ...), sensor after sensor, and the errors of laws beneath."""
        return self.plain(e) if self.slack is None else self.slack.stacked(self.plain(e))

    def plain(self, e: np.ndarray) -> np.ndarray:
        """The same where the laws are exact; after them the slow residuals by their standard deviation."""
        return np.concatenate([*whitened(self.noise, e, self.present), *(one.of(e) / one.sigma for one in self.slow)])

    @property
    def slack(self) -> Slack | None:
        """What the laws may be wrong by, under this noise."""
        if self._slack is None and self.errors is not None:
            self._slack = Slack(self.plain(self.errors), self.power)
        return self._slack

    def slackened(self, errors: np.ndarray | None, odds: float = 0.0) -> "Likelihood":
        """The same where laws may be wrong by columns (blocks, sensors, columns) of standard deviation one; `odds`,
        nats, are against laws that are as exact."""
        other = copy(self)
        other.errors, other.odds, other._slack = errors, odds, None
        return other

    def described(self, own: Inexact | None) -> Self:
        """The same where the description itself may be wrong, whatever is fitted beside it."""
        other = copy(self)
        other.own = own
        return other

    def left(self, e: np.ndarray) -> np.ndarray:
        """What errors of the laws leave of residuals (blocks, sensors)."""
        if self.slack is None or self.errors is None:
            return e
        return np.asarray(e + self.errors @ self.slack.size(self.plain(e)))

    @property
    def power(self) -> float:
        """Share of it that counts."""
        return coarsened(self.size)

    def told(self, e: np.ndarray) -> "Likelihood":
        """The same with the noise of these residuals (blocks, sensors), less what errors of the laws explain."""
        return self.noisy(self.left(e))

    def noisy(self, e: np.ndarray) -> "Likelihood":
        """The same with the noise of these residuals (blocks, sensors)."""
        other = copy(self)
        other._slack = None
        other.noise, _ = noises_of(e, self.present, ORDER, self.least, self.growth)
        other.slow = [one.told(e) for one in self.slow]
        return other

    def flat(self, e: np.ndarray) -> "Likelihood":
        """The same with white noise as loud as these residuals (blocks, sensors): least squares.

        An autoregression holds a large effect for noise, so that a fit under it moves by events alone.
        """
        other = copy(self)
        other._slack = None
        other.noise = [
            Noise(np.ones(1), max(float(np.std(e[rows, c])), float(self.least[c])))
            for c, rows in enumerate(self.present)
        ]
        other.slow = [one.told(e) for one in self.slow]
        return other

    def loss(self, e: np.ndarray) -> float:
        """Negative logarithm of the likelihood of residuals under a noise of their own, up to a constant, nats."""
        return float(self.losses(e, 1)[0])

    def losses(self, e: np.ndarray, count: int) -> np.ndarray:
        """The same by segment of the rows (count,), nats: their sum is the loss."""
        if self.slack is None or self.errors is None:
            return self.parted(e, count)
        a = self.slack.size(self.plain(e))
        beneath = (0.5 * float(a @ a) + self.odds) / self.power + self.slack.volume
        return self.parted(e + self.errors @ a, count) + beneath / count

    def parted(self, e: np.ndarray, count: int) -> np.ndarray:
        """The same where the laws are exact."""
        out = np.zeros(count)
        for rows, own, r in zip(self.present, *noises_of(e, self.present, ORDER, self.least, self.growth), strict=True):
            segment = rows[own.order :] * count // len(e)
            out += np.bincount(segment, surprise(r, own.sigma), count)
        return np.asarray(out + sum(one.losses(e, count) for one in self.slow))

    def foretold(self, e: np.ndarray, other: "Likelihood") -> float:
        """Negative logarithm of the likelihood of residuals under the noise that `other` rows showed, nats.

        Its size is that of these rows where they are louder: a model that followed the other rows to the noise of the
        sensor would else lose by each small error more than one that never came near.
        """
        out = 0.0
        for (part, own), before in zip(self.cut(e), other.parts, strict=True):
            noises = [noise.averaged() for noise in before.noise]
            for r, noise in zip(whitened(noises, own, part.present), noises, strict=True):
                louder = max(float(np.sqrt(np.mean(r**2))), 1.0) if len(r) else 1.0
                out += float(np.sum(surprise(r / louder, louder * noise.sigma * np.ones(len(r)))))
        return out

    @property
    def size(self) -> int:
        """Number of innovations."""
        return sum(len(rows) - noise.order for rows, noise in zip(self.present, self.noise, strict=True))

    @property
    def parts(self) -> Sequence["Likelihood"]:
        """The likelihood of each recording: this one."""
        return (self,)

    def cut(self, e: np.ndarray) -> list[tuple["Likelihood", np.ndarray]]:
        """The part of residuals (blocks, ...) that belongs to each recording."""
        return [(self, e)]

    @property
    def spread(self) -> np.ndarray:
        """Standard deviation of each channel, SI; 1 where it is constant."""
        found = np.std(self.target[slice(*self.rows)], axis=0)
        return np.asarray(np.where(found > 0.0, found, 1.0))

    def split(self, share: float) -> tuple["Likelihood", "Likelihood"]:
        """The same of the first rows, and of the last `share` of them."""
        begin, end = self.rows
        cut = end - round(share * (end - begin))
        return self.during(begin, cut), self.during(cut, end)

    def during(self, begin: int, end: int) -> "Likelihood":
        """The same of rows `begin` to `end`."""
        other = self.slackened(None).described(None)
        other.rows = (max(begin, self.rows[0]), end)
        other.noise = [noise.averaged() for noise in self.noise]
        for derived in ("present", "growth"):
            other.__dict__.pop(derived, None)
        return other


def averaged(x: np.ndarray, count: int) -> np.ndarray:
    """Means (n / count,) of each `count` neighbours among values (n,).

    A sum of columns: a mean along so short an axis takes five times as long.
    """
    parts = x.reshape(-1, count)
    total = parts[:, 0].copy()
    for k in range(1, count):
        total += parts[:, k]
    return np.asarray(total / count)


def sensor_body(sim: Simulator, name: str) -> str | None:
    """Body of a channel; None where it looks at none."""
    found = sim.case.machine.sensors.get(name)
    return None if found is None else found.body


def coarsened(size: int, most: float = INNOVATIONS) -> float:
    """Share of the likelihood of `size` innovations that counts where they count for `most` at most."""
    return most / (most + size)


def settled(sim: Simulator) -> int:
    """First row that counts: the machine has moved and forgotten how it stood before the recording began.

    Of a free response it is the first of all: the state there is fitted.
    """
    if sim.case.problem == "free":
        return 0
    y = sim.seen
    moved = int(np.argmax(np.abs(y - y[0]) > 0.01 * np.ptp(y)))
    return min(moved + round(FORGET / sim.follow / sim.record.dt), len(y) // 5)
