"""Decoding of counters without direction: direction and position of every counted edge of a reel.

A count is an edge of a slotted disc: the next edge if the motion continued, the last edge if it reversed. The two
candidates lie a whole count apart. A model that follows the capstan predicts the motion of the reel since the last
edge to a few hundredths of a count, and so decides the direction of every count. The angle of the reel is then known
at every edge up to one constant: the initial angle of the disc. A sensor of rising edges has other edges in the
backward direction: half a count off, with a constant of their own.

Source: thesis 7.1.3 and 7.4 for the sensors; two-phase decoding gets the direction with the pulse.
"""

from typing import NamedTuple

import numpy as np

FEWEST = 20  # counts of a reel, at least
SURE = 0.12  # counts, rms error of the model between neighbouring edges up to which directions are accepted
OWN = 0.02  # counts, standard deviation of the edges of a disc under a correct model
EVERY: tuple[float, ...] = (0.0,)  # counts from the last forward edge to the first backward one, sensor of all edges
RISING: tuple[float, ...] = (0.5, -0.5)  # counts from the last edge before a reversal to the next, rising edges


class Edges(NamedTuple):
    """Edges of one reel, in the order of their rows."""

    channel: int  # of the simulator's sensors
    rows: np.ndarray  # (n,) first row that holds the count: the edge passed in the tick before
    at: np.ndarray  # (n,) position of the edge, counts from the initial position
    sigma: np.ndarray  # (n,) noise, counts
    group: np.ndarray  # (n,) number of the constant of the edge
    share: np.ndarray  # (n,) share of the motion in the tick at which the edge passed: one half for a single edge

    def between(self, start: int, stop: int) -> "Edges":
        """Edges in the rows from `start` to `stop`."""
        keep = (self.rows >= start) & (self.rows < stop)
        return Edges(self.channel, *(x[keep] for x in self[1:]))

    def way(self, out: np.ndarray) -> np.ndarray:
        """Simulated position (n,) at the edges, counts, from readings out (rows, sensors) with direction."""
        y = out[:, self.channel]
        return y[self.rows - 1] + self.share * (y[self.rows] - y[self.rows - 1])

    def error(self, out: np.ndarray) -> np.ndarray:
        """Residual (n,) of the edges by their noise; the constants are the weighted least-squares ones."""
        e, weight = self.at - self.way(out), 1.0 / (self.sigma * self.sigma)
        mean = np.bincount(self.group, weight * e) / np.maximum(np.bincount(self.group, weight), 1e-12)
        found: np.ndarray = (e - mean[self.group]) / self.sigma
        return found


def edges(counts: np.ndarray, way: np.ndarray, channel: int) -> Edges | None:
    """Decoded edges of the readings (n,) of a counter, by the signed position (n,) of the reel in a model, counts.

    None where the counts are too few, or the error of the model is too large to decide the directions.
    """
    steps = np.diff(np.rint(counts).astype(np.int64))
    if not np.isfinite(way).all() or steps.sum() < FEWEST or (steps < 0).any():
        return None
    rows = np.repeat(np.arange(1, len(counts)), steps)
    count = steps[rows - 1]  # edges in the tick, which share its motion
    share = (np.arange(len(rows)) - np.searchsorted(rows, rows) + 0.5) / count
    predicted = way[rows - 1] + share * (way[rows] - way[rows - 1])
    moved = np.abs(np.diff(way))[rows - 1] / count
    turns = EVERY
    forward, at, off = followed(predicted, turns)
    turned = forward[1:] != forward[:-1]
    if turned.any() and np.median(np.abs(off[turned])) > 0.5 * RISING[0]:
        turns = RISING
        forward, at, off = followed(predicted, turns)
    if np.mean(off**2) > SURE**2 + np.mean(moved**2) / 6.0:
        return None
    group = forward.astype(int) if turns == RISING else np.zeros(len(at), int)
    found = Edges(channel, rows, at, np.hypot(OWN, moved / np.sqrt(12.0)), group, share)
    return found if len(rows) <= len(counts) else one_a_tick(found)


def one_a_tick(found: Edges) -> Edges:
    """Edges merged to one in each tick, at the middle of the edges in the tick, as for a freely spinning reel: they are
    one reading, whose ends are known to a count."""
    first = np.flatnonzero(np.diff(found.rows, prepend=-1))
    last = np.append(first[1:], len(found.rows)) - 1
    at, middle = 0.5 * (found.at[first] + found.at[last]), np.full(len(first), 0.5)
    return Edges(found.channel, found.rows[first], at, found.sigma[first], found.group[first], middle)


def followed(predicted: np.ndarray, turns: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direction (n,) and position (n,) of each edge, and the error (n - 1,) of the model between neighbours, counts.

    `predicted` (n,) is the position of the reel in the model at the edges, counts.
    """
    for _ in range(2):  # an error of the radii scales the whole motion
        forward, steps = directions(np.diff(predicted), turns)
        at = np.concatenate([[0.0], np.cumsum(steps)])
        predicted = predicted * float(np.polyfit(predicted, at, 1)[0])
    return forward, at, steps - np.diff(predicted)


def directions(moved: np.ndarray, turns: tuple[float, ...] = EVERY) -> tuple[np.ndarray, np.ndarray]:
    """Whether each edge (n + 1,) passed forward, and the counts (n,) between neighbours, from the motion (n,) of a
    model between neighbours: the least-squares sequence of directions.

    Two edges in one direction lie a count apart, or are one edge where a sensor of rising edges missed two reversals
    between them. After one reversal `turns` is the distance. Source: Viterbi, IEEE Trans. Information Theory 13 (1967).
    """
    ahead = nearest(moved, (1.0,) if turns == EVERY else (1.0, 0.0))
    behind = nearest(moved, (-1.0,) if turns == EVERY else (-1.0, 0.0))
    there, home = nearest(moved, turns), nearest(moved, tuple(-t for t in turns))
    back, on, over, under = ((moved - to) ** 2 for to in (behind, ahead, there, home))
    cost, came = (0.0, 0.0), np.empty((len(moved), 2), bool)
    for k in range(len(moved)):
        ends = (cost[0] + back[k], cost[1] + over[k]), (cost[0] + under[k], cost[1] + on[k])
        came[k] = [end[1] < end[0] for end in ends]
        cost = min(ends[0]), min(ends[1])
    out = np.empty(len(moved) + 1, bool)
    out[-1] = cost[1] < cost[0]
    for k in range(len(moved) - 1, -1, -1):
        out[k] = came[k, int(out[k + 1])]
    steps = np.where(out[1:] == out[:-1], np.where(out[1:], ahead, behind), np.where(out[:-1], there, home))
    return out, steps


def nearest(values: np.ndarray, among: tuple[float, ...]) -> np.ndarray:
    """Nearest of `among` to each value, (n,)."""
    choice = np.array(among)
    found: np.ndarray = choice[np.argmin(np.abs(values[:, None] - choice), axis=1)]
    return found
