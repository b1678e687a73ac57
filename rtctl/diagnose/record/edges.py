"""What the reels' counters tell edge by edge: they cannot tell direction, and yet each count says where the reel stood.

A count is an edge of a slotted disc that went past, one way or the other: the next one if it went on, the same one if
it came back. The two lie a whole count apart, and a model that follows the capstan knows the way of the reel since the
last edge to a few hundredths of one. So the direction of every count is known, nothing is lost at reversals, and the
reel's angle is known at every edge but for one constant: where the disc stood at first. A sensor that counts only where
dark turns to light has other edges on the way back, half a count off and known but for a constant of their own.

Source: thesis 7.1.3 and 7.4 for the sensors; two-phase decoding, in which the direction comes with the pulse, does the
same.
"""

from typing import NamedTuple

import numpy as np

FEWEST = 20  # counts of a reel, below which it says little
SURE = 0.12  # counts between neighbouring edges, rms, beside the tick that they came in: else directions are guesses
OWN = 0.02  # counts: what a disc and a model that is right leave
EVERY: tuple[float, ...] = (0.0,)  # counts from the last edge forward to the first one back, of a sensor of all edges
RISING: tuple[float, ...] = (0.5, -0.5)  # and of rising ones


class Edges(NamedTuple):
    """The counts of one reel, in the order of their rows."""

    channel: int  # of the simulator's sensors
    rows: np.ndarray  # (n,) first row that holds the count: it came in the tick before
    at: np.ndarray  # (n,) position of the edge, counts from where it stood at first
    sigma: np.ndarray  # (n,) noise, counts
    group: np.ndarray  # (n,) of edges whose constant is the same
    share: np.ndarray  # (n,) of the tick's way that was gone when it came: the middle, where it came alone

    def between(self, start: int, stop: int) -> "Edges":
        """Those of these rows."""
        keep = (self.rows >= start) & (self.rows < stop)
        return Edges(self.channel, *(x[keep] for x in self[1:]))

    def way(self, out: np.ndarray) -> np.ndarray:
        """Simulated position (n,) at the edges, counts, of readings out (rows, sensors) that keep their direction."""
        y = out[:, self.channel]
        return y[self.rows - 1] + self.share * (y[self.rows] - y[self.rows - 1])

    def error(self, out: np.ndarray) -> np.ndarray:
        """Edges less simulation, by their noise, (n,); the constants are those that fit best."""
        e, weight = self.at - self.way(out), 1.0 / (self.sigma * self.sigma)
        mean = np.bincount(self.group, weight * e) / np.maximum(np.bincount(self.group, weight), 1e-12)
        found: np.ndarray = (e - mean[self.group]) / self.sigma
        return found


def edges(counts: np.ndarray, way: np.ndarray, channel: int) -> Edges | None:
    """Of a counter's readings (n,), seen by the way (n,) that a model gives the reel, in counts with their direction.

    None where there are too few, or where the model is so far off that it does not know the directions.
    """
    steps = np.diff(np.rint(counts).astype(np.int64))
    if not np.isfinite(way).all() or steps.sum() < FEWEST or (steps < 0).any():
        return None
    rows = np.repeat(np.arange(1, len(counts)), steps)
    count = steps[rows - 1]  # that came in its tick, and share the way
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
    """The same with one edge in the middle of all that came in a tick, as where a reel spins freely: they are one
    reading, of which both ends are known to a count."""
    first = np.flatnonzero(np.diff(found.rows, prepend=-1))
    last = np.append(first[1:], len(found.rows)) - 1
    at, middle = 0.5 * (found.at[first] + found.at[last]), np.full(len(first), 0.5)
    return Edges(found.channel, found.rows[first], at, found.sigma[first], found.group[first], middle)


def followed(predicted: np.ndarray, turns: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which way each edge (n,) went, where it lies, and by how much the model differs from one to the next (n - 1,).

    `predicted` (n,) is the way that the model gives it, in counts.
    """
    for _ in range(2):  # radii that are a little off stretch the whole way
        forward, steps = directions(np.diff(predicted), turns)
        at = np.concatenate([[0.0], np.cumsum(steps)])
        predicted = predicted * float(np.polyfit(predicted, at, 1)[0])
    return forward, at, steps - np.diff(predicted)


def directions(moved: np.ndarray, turns: tuple[float, ...] = EVERY) -> tuple[np.ndarray, np.ndarray]:
    """Whether each edge (n + 1,) went past forward, and the counts (n,) from one to the next, from the way (n,) that a
    model goes between them.

    Two edges the same way lie a count apart, or are the same edge where a sensor of rising ones did not see that it
    turned twice between them; after one turn `turns` say how far: of all sequences that with the least squares of what
    the model's way has too much. Source: Viterbi, IEEE Trans. Information Theory 13 (1967).
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
    """The nearest of `among` to each value, (n,)."""
    choice = np.array(among)
    found: np.ndarray = choice[np.argmin(np.abs(values[:, None] - choice), axis=1)]
    return found
