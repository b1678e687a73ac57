"""Likelihood of a recording under a model: innovations of the residuals that the tracking observer leaves.

The residual of each sensor is averaged over a few ticks, made white by an autoregression (noise.py) and weighed by its
innovation. The negative logarithm of the likelihood is half the sum of squares plus n ln sigma for each sensor, so that
models compare each under a noise of its own.

Source: Ljung, System Identification (1999), ch. 7 and 16.4.
"""

from collections.abc import Sequence
from copy import copy

import numpy as np

from rtctl.diagnose.edges import Edges
from rtctl.diagnose.graph.model import GraphModel
from rtctl.diagnose.graph.noise import Noise, noise_of
from rtctl.diagnose.graph.simulate import Simulator

RATE = 500.0  # 1/s, of the averaged residuals
ORDER = 20  # of the autoregression
FORGET = 8.0  # over the bandwidth of the observer: until the start is forgotten
QUANTISED = 0.29  # of a step: the least that counting leaves in a residual
EDGE = 0.03  # of a step: the least that an edge leaves, whose tick is known
WILD = 1e6  # residual of a model that runs away, in steps of noise


class Likelihood:
    """A recording, its noise and the rows that count."""

    together = 1.0  # errors that count as one in the weight of the prior (rtctl.diagnose.fit)

    def __init__(self, sim: Simulator, noise: Sequence[Noise] | None = None, rows: tuple[int, int] | None = None):
        self.sim = sim
        record = sim.record
        self.mean = max(1, round(1.0 / (RATE * record.dt)))
        self.channels = [sim.layout.sensors[name] for name in sim.channels]
        begin = min(settled(sim), len(record.t) // 4)
        self.rows = (begin, len(record.t)) if rows is None else rows
        self.target = np.stack([record.y[name] for name in sim.channels], axis=1)
        grain = np.array([record.grain[name] for name in sim.channels])
        smooth = np.std(np.diff(self.target, 2, axis=0), axis=0) / 10.0
        self.least = np.where(grain > 0.0, QUANTISED * grain, np.maximum(smooth, 1e-12)) / np.sqrt(self.mean)
        self.least = np.where([name in sim.edges for name in sim.channels], EDGE * grain, self.least)
        self.noise: list[Noise] = list(noise) if noise is not None else [
            Noise(np.ones(1), float(max(least, 1e-300))) for least in self.least
        ]  # fmt: skip

    def raw(self, model: GraphModel, coarse: bool = False) -> np.ndarray:
        """Residuals (blocks, sensors), SI, averaged over `mean` ticks.

        The constant of the followed sensor is that of a force. Where the others began to count says nothing: theirs is
        left out.
        """
        out = self.sim.run(model, n=self.rows[1], coarse=coarse)
        return self.of_readings(out)

    def of_readings(self, out: np.ndarray) -> np.ndarray:
        """The same of simulated readings (n, sensors of the machine)."""
        begin, end = self.rows
        e = self.target[begin:end] - out[begin:end, self.channels]
        keep = len(e) // self.mean * self.mean
        e = e[:keep].reshape(-1, self.mean, e.shape[1]).mean(axis=1)
        for c, name in enumerate(self.sim.channels):
            if name in self.sim.edges:
                e[:, c] = self._by_edges(name, out, len(e))
        wild = WILD * self.least
        if not (np.abs(e) < wild).all():  # ran away: no noise explains it
            e[~(np.abs(e) < wild).all(axis=1)] = wild
            e[::2] *= -1.0
        beside = np.array([name != self.sim.main for name in self.sim.channels])
        beside &= np.array([name not in self.sim.edges for name in self.sim.channels])
        return np.asarray(e - np.where(beside, e.mean(axis=0), 0.0))

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

    def present(self, c: int) -> np.ndarray | slice:
        """Blocks in which sensor `c` shows something: all, or those with an edge."""
        name = self.sim.channels[c]
        return np.unique(self.edges_in(name)[1]) if name in self.sim.edges else slice(None)

    def white(self, e: np.ndarray) -> np.ndarray:
        """Innovations of residuals (blocks, sensors), sensor after sensor."""
        return np.concatenate([noise.whiten(e[self.present(c), c]) for c, noise in enumerate(self.noise)])

    def residual(self, model: GraphModel, coarse: bool = False, at: str = "") -> np.ndarray:
        """Innovations of a model, as a fit minimises them."""
        return self.white(self.raw(model, coarse))

    def told(self, e: np.ndarray) -> "Likelihood":
        """The same with the noise of these residuals (blocks, sensors)."""
        other = copy(self)
        other.noise = [noise_of(e[self.present(c), c], ORDER, float(self.least[c])) for c in range(e.shape[1])]
        return other

    def loss(self, e: np.ndarray) -> float:
        """Negative logarithm of the likelihood of residuals under a noise of their own, up to a constant, nats."""
        total = 0.0
        for c in range(e.shape[1]):
            shown = e[self.present(c), c]
            own = noise_of(shown, ORDER, float(self.least[c]))
            r = own.whiten(shown)
            total += len(r) * float(np.log(own.sigma)) + 0.5 * float(r @ r)
        return total

    def filtered(self, columns: np.ndarray) -> np.ndarray:
        """The same filters on many residuals at once (blocks, sensors, columns): (innovations, columns)."""
        return np.concatenate([noise.whiten(columns[self.present(c), c]) for c, noise in enumerate(self.noise)])

    @property
    def size(self) -> int:
        """Number of innovations."""
        blocks = (self.rows[1] - self.rows[0]) // self.mean
        shown = [len(np.arange(blocks)[self.present(c)]) for c in range(len(self.noise))]
        return sum(n - noise.order for n, noise in zip(shown, self.noise, strict=True))

    def during(self, begin: int, end: int) -> "Likelihood":
        """The same of rows `begin` to `end`."""
        other = copy(self)
        other.rows = (max(begin, self.rows[0]), end)
        return other


def settled(sim: Simulator) -> int:
    """First row that counts: the machine has moved and forgotten how it stood before the recording began."""
    y = sim.seen
    moved = int(np.argmax(np.abs(y - y[0]) > 0.01 * np.ptp(y)))
    return min(moved + round(FORGET / sim.follow / sim.record.dt), len(y) // 5)
