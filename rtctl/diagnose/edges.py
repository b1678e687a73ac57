"""What the reels' counters tell edge by edge: they cannot tell direction, and yet each count says where the reel stood.

A count is an edge of a slotted disc that went past, one way or the other: the next one if it went on, the same one if
it came back. The two lie a whole count apart, and a model that follows the capstan knows the way of the reel since the
last edge to a few hundredths of one. So the direction of every count is known, nothing is lost at reversals, and the
reel's angle is known at every edge but for one constant: where the disc stood at first.

Source: thesis 7.1.3 for the sensors; two-phase decoding, in which the direction comes with the pulse, does the same.
"""

from typing import NamedTuple

import numpy as np

FEWEST = 20  # counts of a reel, below which it says little
SURE = 0.12  # counts between neighbouring edges, rms, beside the tick that they came in: else directions are guesses
OWN = 0.02  # counts: what a disc and a model that is right leave


class Edges(NamedTuple):
    """The counts of one reel, in the order of their rows."""

    channel: int  # of the simulator's sensors
    rows: np.ndarray  # (n,) first row that holds the count: it came in the tick before
    at: np.ndarray  # (n,) position of the edge, counts from where it stood at first
    sigma: np.ndarray  # (n,) noise, counts

    def between(self, start: int, stop: int) -> "Edges":
        """Those of these rows."""
        keep = (self.rows >= start) & (self.rows < stop)
        return self._replace(rows=self.rows[keep], at=self.at[keep], sigma=self.sigma[keep])

    def way(self, out: np.ndarray) -> np.ndarray:
        """Simulated position (n,) at the edges, counts, of readings out (rows, sensors) that keep their direction."""
        y = out[:, self.channel]
        return 0.5 * (y[self.rows - 1] + y[self.rows])

    def error(self, out: np.ndarray) -> np.ndarray:
        """Edges less simulation, by their noise, (n,); the constant is what fits best."""
        e = self.at - self.way(out)
        weight = self.sigma**-2
        found: np.ndarray = (e - weight @ e / weight.sum()) / self.sigma
        return found


def edges(counts: np.ndarray, way: np.ndarray, channel: int) -> Edges | None:
    """Of a counter's readings (n,), seen by the way (n,) that a model gives the reel, in counts with their direction.

    None where there are too few, or where the model is so far off that it does not know the directions.
    """
    steps = np.diff(np.rint(counts).astype(np.int64))
    if not np.isfinite(way).all() or steps.sum() < FEWEST or (steps < 0).any():
        return None
    rows = np.repeat(np.arange(1, len(counts)), steps)
    predicted = 0.5 * (way[rows - 1] + way[rows])
    moved = np.abs(np.diff(way))[rows - 1]
    for _ in range(2):  # radii that are a little off stretch the whole way
        forward = directions(np.diff(predicted))
        at = np.concatenate([[0], np.cumsum(np.where(forward[1:] == forward[:-1], np.where(forward[1:], 1, -1), 0))])
        predicted = predicted * float(np.polyfit(predicted, at, 1)[0])
    if np.mean((np.diff(at) - np.diff(predicted)) ** 2) > SURE**2 + np.mean(moved**2) / 6.0:
        return None
    return Edges(channel, rows, at.astype(float), np.hypot(OWN, moved / np.sqrt(12.0)))


def directions(moved: np.ndarray) -> np.ndarray:
    """Whether each edge (n + 1,) went past forward, from the way (n,) that a model goes from one to the next.

    Two edges the same way lie a count apart, and there and back again is the same edge: of all sequences that with the
    least squares of what the model's way has too much. Source: Viterbi, IEEE Trans. Information Theory 13 (1967).
    """
    back, turn, on = ((moved + 1.0) ** 2, moved**2, (moved - 1.0) ** 2)
    cost, came = (0.0, 0.0), np.empty((len(moved), 2), bool)
    for k in range(len(moved)):
        ends = (cost[0] + back[k], cost[1] + turn[k]), (cost[0] + turn[k], cost[1] + on[k])
        came[k] = [end[1] < end[0] for end in ends]
        cost = min(ends[0]), min(ends[1])
    out = np.empty(len(moved) + 1, bool)
    out[-1] = cost[1] < cost[0]
    for k in range(len(moved) - 1, -1, -1):
        out[k] = came[k, int(out[k + 1])]
    return out
