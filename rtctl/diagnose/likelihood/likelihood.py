"""Likelihood of a recording under a model: innovations of the residuals under the tracking observer.

The residual of each sensor is averaged over a few ticks, whitened by an autoregression (noise.py) and divided by the
standard deviation of its innovations. The negative logarithm of the likelihood is half the sum of squares plus n ln
sigma for each sensor: models with different noise are comparable.

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

RATE = 500.0  # 1/s: rate of the averaged residuals
ORDER = 20  # order of the autoregression
FORGET = 8.0  # time constants of the observer, after which the initial state has decayed
QUANTISED = 0.29  # share of a sensor step: least rms of a residual, by counting (1 / sqrt 12)
SMOOTH = 9  # blocks: window of the rate of a reading
EDGE = 0.03  # share of a sensor step: least rms of a residual at an edge with a known tick
WILD = 1e6  # times the least noise: residual of a diverged model


class Likelihood:
    """Likelihood of a recording: its noise and the rows that count."""

    errors: np.ndarray | None = None  # (blocks, sensors, columns) errors of the laws of a model
    odds: float = 0.0  # nats of prior odds against laws of this exactness
    own: Inexact | None = None  # errors of the description itself, beside any effect
    _slack: Slack | None = None  # errors of the laws, under this noise

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
        if sim.case.problem == "kinematic":  # counting noise of the first position moves the others
            passed = np.array([sim.ratios.get(str(sensor_body(sim, name)), 0.0) for name in sim.channels])
            self.least = np.hypot(self.least, QUANTISED * record.grain[sim.main] * passed / np.sqrt(self.mean))
        self.noise: list[Noise] = list(noise) if noise is not None else [
            Noise(np.ones(1), float(max(least, 1e-300))) for least in self.least
        ]  # fmt: skip
        self.slow = slow(sim, self.channels, self.mean)

    def raw(self, model: GraphModel, coarse: bool = False) -> np.ndarray:
        """Residuals (blocks, sensors), SI, averaged over `mean` ticks.

        The mean residual of the followed sensor shows a constant force. The mean residual of any other sensor depends
        on the start of its count, and is removed.
        """
        out = self.sim.run(model, n=self.rows[1], coarse=coarse)
        return self.of_readings(out)

    def rough(self, model: GraphModel) -> tuple[np.ndarray, bool]:
        """Residuals (blocks, sensors) of a coarse simulation, for difference quotients, and whether it is coarse.

        Where a model diverges at twice the step, the simulation is fine.
        """
        e = self.raw(model, True)
        return (self.raw(model), False) if self.ran_away(e) else (e, True)

    def of_readings(self, out: np.ndarray) -> np.ndarray:
        """Residuals (blocks, sensors), SI, of simulated readings (n, sensors of the machine)."""
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
        if not (np.abs(e) < wild).all():  # diverged: no noise explains it
            gone = ~(np.abs(e) < wild).all(axis=1)
            e[gone] = wild * np.random.default_rng(0).choice((-1.0, 1.0), (int(gone.sum()), e.shape[1]))
        beside = np.array([self._floats(name) for name in self.sim.channels])
        return np.asarray(e - np.where(beside, e.mean(axis=0), 0.0))

    def ran_away(self, e: np.ndarray) -> bool:
        """Whether residuals (blocks, sensors) are of a diverged model."""
        return not bool((np.abs(e) < 0.5 * WILD * self.least).all())

    def _floats(self, name: str) -> bool:
        """Whether the mean residual of a channel is arbitrary and still in its residuals."""
        if name in self.sim.edges:
            return False
        if self.sim.case.problem != "static":
            return name != self.sim.main
        return self._is_position(name)

    def _by_edges(self, name: str, out: np.ndarray, blocks: int) -> np.ndarray:
        """Residual (blocks,) of a sensor that shows edges: mean over the edges of a block, 0 without edges."""
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
        """Blocks in which each sensor has information: all blocks, or the blocks with an edge.

        A force under a recorded motion has no information in blocks with a reversal: the time of a reversal is known to
        a row only, and dry friction jumps there.
        """
        every = np.arange((self.rows[1] - self.rows[0]) // self.mean)
        steady = every if self.sim.held is None else np.setdiff1d(every, self._turns(self.sim.held.v))
        return [
            np.unique(self.edges_in(n)[1]) if n in self.sim.edges else every if self._is_position(n) else steady
            for n in self.sim.channels
        ]

    def _turns(self, v: np.ndarray) -> np.ndarray:
        """Blocks before and after each reversal of a motion of the speed v (n,)."""
        last = np.flatnonzero(np.diff(np.sign(v)))
        return (np.concatenate([last, last + 1]) - self.rows[0]) // self.mean

    def _is_position(self, name: str) -> bool:
        """Whether a channel is the reading of a position."""
        sensors = self.sim.case.machine.sensors
        return name in sensors and sensors[name].measures == "position"

    @cached_property
    def growth(self) -> list[np.ndarray]:
        """Regressors (blocks present, columns) of the variance of each sensor's residual.

        A sensor that counts has one for motion. A position has its squared rate, which shows timing errors.
        """
        begin, end = self.rows
        blocks = (end - begin) // self.mean
        y = self.target[begin:end][: blocks * self.mean].reshape(blocks, self.mean, -1).mean(axis=1)
        rate = np.gradient(uniform_filter1d(y, SMOOTH, axis=0), axis=0) ** 2  # squared change per block
        out = []
        for c, (name, rows) in enumerate(zip(self.sim.channels, self.present, strict=True)):
            grain = self.sim.record.grain[name]
            columns = [rate[:, c] / (rate[:, c] + grain**2)] if grain > 0.0 else []
            if self._is_position(name):
                columns.append(rate[:, c])
            out.append(np.stack(columns, axis=1)[rows] if columns else np.zeros((len(rows), 0)))
        return out

    def directed(self, model: GraphModel) -> "Likelihood":
        """Likelihood with the sensors that show no direction; the model gives the directions of their edges."""
        return Likelihood(self.sim.directed(model))

    def following(self, times: float) -> "Likelihood":
        """Likelihood of these rows with an observer of `times` the bandwidth, and with exact laws."""
        other = self.slackened(None).described(None)
        other.sim = self.sim.following(times)
        other.slow = slow(other.sim, self.channels, self.mean)
        return other

    def white(self, e: np.ndarray) -> np.ndarray:
        """Innovations of residuals (blocks, sensors, ...), sensor after sensor, then the errors of the laws."""
        return self.plain(e) if self.slack is None else self.slack.stacked(self.plain(e))

    def plain(self, e: np.ndarray) -> np.ndarray:
        """Innovations of residuals (blocks, sensors, ...) with exact laws, then normalised slow residuals."""
        return np.concatenate([*whitened(self.noise, e, self.present), *(one.of(e) / one.sigma for one in self.slow)])

    @property
    def slack(self) -> Slack | None:
        """Errors of the laws under this noise; None where the laws are exact."""
        if self._slack is None and self.errors is not None:
            self._slack = Slack(self.plain(self.errors), self.power)
        return self._slack

    def slackened(self, errors: np.ndarray | None, odds: float = 0.0) -> "Likelihood":
        """Likelihood with errors of the laws: columns (blocks, sensors, columns) of standard deviation one.

        `odds`, nats, are against laws of this exactness.
        """
        other = copy(self)
        other.errors, other.odds, other._slack = errors, odds, None
        return other

    def described(self, own: Inexact | None) -> Self:
        """Likelihood with errors of the description itself, beside any effect."""
        other = copy(self)
        other.own = own
        return other

    def left(self, e: np.ndarray) -> np.ndarray:
        """Residuals (blocks, sensors) without the most probable errors of the laws."""
        if self.slack is None or self.errors is None:
            return e
        return np.asarray(e + self.errors @ self.slack.size(self.plain(e)))

    @property
    def power(self) -> float:
        """Power of the likelihood: share of its innovations that counts."""
        return coarsened(self.size)

    def told(self, e: np.ndarray) -> "Likelihood":
        """Likelihood with the noise of the residuals e (blocks, sensors), without the errors of the laws."""
        return self.noisy(self.left(e))

    def noisy(self, e: np.ndarray) -> "Likelihood":
        """Likelihood with the noise of the residuals e (blocks, sensors)."""
        other = copy(self)
        other._slack = None
        other.noise, _ = noises_of(e, self.present, ORDER, self.least, self.growth)
        other.slow = [one.told(e) for one in self.slow]
        return other

    def flat(self, e: np.ndarray) -> "Likelihood":
        """Likelihood with white noise of the standard deviation of the residuals e (blocks, sensors): least squares.

        An autoregression takes a large effect for noise: a fit under it follows sudden events only.
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
        """Losses (count,) by segment of the rows, nats; their sum is the loss."""
        if self.slack is None or self.errors is None:
            return self.parted(e, count)
        a = self.slack.size(self.plain(e))
        beneath = (0.5 * float(a @ a) + self.odds) / self.power + self.slack.volume
        return self.parted(e + self.errors @ a, count) + beneath / count

    def parted(self, e: np.ndarray, count: int) -> np.ndarray:
        """Losses (count,) by segment of the rows, nats, with exact laws."""
        out = np.zeros(count)
        for rows, own, r in zip(self.present, *noises_of(e, self.present, ORDER, self.least, self.growth), strict=True):
            segment = rows[own.order :] * count // len(e)
            out += np.bincount(segment, surprise(r, own.sigma), count)
        return np.asarray(out + sum(one.losses(e, count) for one in self.slow))

    def foretold(self, e: np.ndarray, other: "Likelihood") -> float:
        """Negative logarithm of the likelihood of residuals under the noise of the rows of `other`, nats.

        The noise level is raised to that of these rows where it is larger. A model that fits the other rows down to
        sensor noise would otherwise lose more by each small error than a model with a poor fit.
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
        """This likelihood, with all residuals e (blocks, ...): there is one recording."""
        return [(self, e)]

    @property
    def spread(self) -> np.ndarray:
        """Standard deviation of each channel, SI; 1 where it is constant."""
        found = np.std(self.target[slice(*self.rows)], axis=0)
        return np.asarray(np.where(found > 0.0, found, 1.0))

    def split(self, share: float) -> tuple["Likelihood", "Likelihood"]:
        """Likelihoods of the first rows, and of the last `share` of the rows."""
        begin, end = self.rows
        cut = end - round(share * (end - begin))
        return self.during(begin, cut), self.during(cut, end)

    def during(self, begin: int, end: int) -> "Likelihood":
        """Likelihood of rows `begin` to `end`."""
        other = self.slackened(None).described(None)
        other.rows = (max(begin, self.rows[0]), end)
        other.noise = [noise.averaged() for noise in self.noise]
        for derived in ("present", "growth"):
            other.__dict__.pop(derived, None)
        return other


def averaged(x: np.ndarray, count: int) -> np.ndarray:
    """Means (n / count,) of each `count` neighbours among values (n,).

    A sum of columns takes a fifth of the time of a mean along a short axis.
    """
    parts = x.reshape(-1, count)
    total = parts[:, 0].copy()
    for k in range(1, count):
        total += parts[:, k]
    return np.asarray(total / count)


def sensor_body(sim: Simulator, name: str) -> str | None:
    """Body of a channel; None where the channel has no body."""
    found = sim.case.machine.sensors.get(name)
    return None if found is None else found.body


def coarsened(size: int, most: float = INNOVATIONS) -> float:
    """Power of the likelihood of `size` innovations, whose effective number is `most` at most."""
    return most / (most + size)


def settled(sim: Simulator) -> int:
    """First row that counts: the machine has moved, and its state before the recording has decayed.

    For a free response it is row 0: the fit includes the state there.
    """
    if sim.case.problem == "free":
        return 0
    y = sim.seen
    moved = int(np.argmax(np.abs(y - y[0]) > 0.01 * np.ptp(y)))
    return min(moved + round(FORGET / sim.follow / sim.record.dt), len(y) // 5)
