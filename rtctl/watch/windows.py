"""Windows of a running machine: residuals, missing forces and motion in even pieces of time.

A window is ten slow blocks. A slow block is the averaging time of slow signals in the diagnosis (three time constants
of the observer), so that neighbouring blocks are nearly independent. Residuals are averaged to the rate at which the
diagnosis whitens them (likelihood.RATE), whatever the rate of the loop.
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.likelihood.likelihood import FORGET, RATE
from rtctl.watch.observer import Observer

BLOCKS = 10  # slow blocks in a window
STEPS = 3.0  # steps of a sensor in a slow block, below which the body is at rest
SLIGHT = 0.02  # of the usual step of the reference in a slow block, below which the reference is at rest


class Shape(NamedTuple):
    """Lengths of blocks and windows, in ticks."""

    mean: int  # of a residual
    slow: int
    dt: float  # s, of a tick

    @property
    def window(self) -> int:
        """Ticks of a window."""
        return BLOCKS * self.slow

    @property
    def seconds(self) -> float:
        """Length of a window, s."""
        return self.window * self.dt


class Batch(NamedTuple):
    """Windows that follow each other, or belong to several stretches."""

    t: np.ndarray  # (windows,) s, controller clock at the end of each
    e: np.ndarray  # (windows, blocks, sensors) residuals, SI
    force: np.ndarray  # (windows, BLOCKS, followed) correction, N or Nm at the followed bodies
    v: np.ndarray  # (windows, BLOCKS, followed) speed of the followed readings, SI
    a: np.ndarray  # (windows, BLOCKS, followed) their acceleration
    asked: np.ndarray  # (windows, BLOCKS) change of the reference in each block, its unit; 0 where it is unknown
    late: np.ndarray  # (windows,) s, largest error of the time of a row or of the age of its sample

    @property
    def size(self) -> int:
        """Number of windows."""
        return len(self.t)

    def some(self, which: np.ndarray | slice) -> "Batch":
        """The windows of a mask, of indices or of a slice."""
        return Batch(*(part[which] for part in self))


def joined(batches: list[Batch]) -> Batch:
    """Several batches as one batch. Raises ValueError for an empty list."""
    return Batch(*(np.concatenate(parts) for parts in zip(*batches, strict=True)))


def shape_of(observer: Observer) -> Shape:
    """Lengths for the rate and the observer of a machine."""
    dt = observer.sim.record.dt
    mean = max(1, round(1.0 / (RATE * dt)))
    return Shape(mean, mean * max(1, round(observer.sim.window / mean)), dt)


class Cutter:
    """Cuts rows of one stretch after the other into windows; a window that lacks rows is dropped."""

    def __init__(self, observer: Observer):
        self._observer, self.shape = observer, shape_of(observer)
        self._followed = observer.followed
        self._settle = int(np.ceil(FORGET / observer.sim.follow / self.shape.seconds)) + 1  # windows
        self.away = 0  # divergences of the model
        self.restart()

    def restart(self) -> None:
        """Begin a new stretch: the next rows do not follow the last rows."""
        self._observer.restart()
        self._parts: list[tuple[np.ndarray, ...]] = []
        self._waiting = 0
        self._left = self._settle
        self._end: tuple[np.ndarray, np.ndarray, float] | None = None  # last mean reading, last speed, last reference

    def feed(
        self, t: np.ndarray, u: np.ndarray, y: np.ndarray, ref: np.ndarray, late: np.ndarray | float = 0.0
    ) -> Batch | None:
        """Windows that are complete, None without one. Times (n,), commands (n, drives), readings (n, sensors),
        reference (n,) and errors of time (n,) in s follow the last rows."""
        self._parts.append((t, u, y, ref, np.broadcast_to(np.asarray(late, float), t.shape)))
        self._waiting += len(t)
        length = self.shape.window
        count = self._waiting // length
        if not count:
            return None
        t, u, y, ref, late = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        whole = count * length
        self._parts = [tuple(part[whole:] for part in (t, u, y, ref, late))]
        self._waiting -= whole
        steps = [self._observer.step(u[k : k + length], y[k : k + length]) for k in range(0, whole, length)]
        e, push = (np.concatenate(part) for part in zip(*steps, strict=True))  # one by one, for any chunk
        worst = np.abs(late[:whole]).reshape(count, length).max(axis=1)
        batch = self._cut(t[:whole], e, push, y[:whole], ref[:whole], worst)
        keep = np.isfinite(batch.e).all(axis=(1, 2))
        if not keep.all():
            self.away += 1
            self._left = self._settle
        elif self._left:
            skip = min(self._left, count)
            self._left -= skip
            keep[:skip] = False
        return batch.some(keep) if keep.any() else None

    def _cut(
        self, t: np.ndarray, e: np.ndarray, push: np.ndarray, y: np.ndarray, ref: np.ndarray, late: np.ndarray
    ) -> Batch:
        shape, count = self.shape, len(late)
        e = e.reshape(count, shape.window // shape.mean, shape.mean, -1).mean(axis=2)
        force = push.reshape(count, BLOCKS, shape.slow, -1).mean(axis=2)
        mean = y[:, self._followed].reshape(count * BLOCKS, shape.slow, -1).mean(axis=1)
        asked = np.nan_to_num(ref).reshape(count * BLOCKS, shape.slow)[:, -1]
        first = (mean[0], np.zeros(mean.shape[1]), asked[0]) if self._end is None else self._end
        step = shape.slow * shape.dt
        speeds = np.array([one.shows_speed for one in self._observer.sim.followed])
        v = np.where(speeds, mean, np.diff(mean, axis=0, prepend=first[0][None]) / step)
        a = np.diff(v, axis=0, prepend=first[1][None]) / step
        change = np.diff(asked, prepend=first[2])
        self._end = mean[-1], v[-1], float(asked[-1])
        pieces = (count, BLOCKS, mean.shape[1])
        return Batch(
            t.reshape(count, -1)[:, -1], e, force, v.reshape(pieces), a.reshape(pieces), change.reshape(count, BLOCKS),
            late,
        )  # fmt: skip
