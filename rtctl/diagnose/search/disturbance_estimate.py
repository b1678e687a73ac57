"""What the record itself suggests: at which order, wavelength, place or time something is missing.

The correction that keeps a fitted model on the recorded track is, up to its bandwidth, what the model lacks, in units
of its input: a disturbance observer. Seen against the angle of a shaft it shows orders, against position spots and
wavelengths. Sudden jumps of the error between two ticks show lost counts.

Source: Ohnishi, Shibata & Murakami, IEEE/ASME Trans. Mechatronics 1 (1996) for the observer; order tracking by least
squares on cosine and sine of the angle, since angles are not evenly sampled.
"""

from typing import NamedTuple

import numpy as np

MOST = 4  # hints of a kind
JUMPS = 47
AROUND = 8  # ticks that a jump is compared with
SURE, UNSURE = 6.0, 4.0  # times the noise from tick to tick: a jump, and one if there are others like it
TWIN = 1.4  # times another jump nearby, which is as large
ALIKE = 2.5  # times the same: jumps that differ by less may be of one size
ORDERS = np.arange(1.0, 61.0)  # whole: what a disc or a shaft adds is the same after each turn
SMOOTH, FEWEST = 51, 200  # rows over which a speed is taken, and without which an order is not looked for


class Along(NamedTuple):
    """An angle, or a way, in which orders are looked for, rows (n,) each."""

    angle: np.ndarray
    by: np.ndarray | float = 1.0  # what the amplitude of a force is proportional to
    motion: tuple[np.ndarray, np.ndarray] | None = None  # speed and acceleration, for an error of the angle itself

    def at(self, rows: np.ndarray) -> "Along":
        """The same of some rows."""
        by = self.by[rows] if isinstance(self.by, np.ndarray) else self.by
        motion = None if self.motion is None else (self.motion[0][rows], self.motion[1][rows])
        return Along(self.angle[rows], by, motion)

    def waves(self, order: float) -> np.ndarray:
        """Cosine and sine (n, 2) of an order, as the signal shows them. What follows an angle that is read wrongly is
        pushed by the second derivative of the error."""
        c, s = np.cos(order * self.angle), np.sin(order * self.angle)
        if self.motion is None:
            return np.stack([self.by * c, self.by * s], axis=1)
        v, a = order * self.motion[0], order * self.motion[1]
        return np.stack([-(v**2) * c - a * s, -(v**2) * s + a * c], axis=1)


def spectrum(along: Along, signal: np.ndarray, orders: np.ndarray, root: np.ndarray | float = 1.0) -> np.ndarray:
    """Share of the variance of `signal` that each order explains, slow drift taken out. `root` is the root of the
    weights of rows."""
    angle = along.angle
    if len(signal) < FEWEST:
        return np.zeros(len(orders))
    z = np.linspace(-1, 1, len(signal))
    slow = np.stack([np.ones_like(z), angle - angle.mean(), np.sign(np.gradient(angle))], axis=1)
    drift = np.linalg.qr((slow.T * root).T)[0]
    rest = signal * root
    rest -= drift @ (drift.T @ rest)
    total = float(rest @ rest) or 1.0
    out = np.zeros(len(orders))
    span = float(np.ptp(angle))
    for k, order in enumerate(orders):
        if order * span < np.pi:  # less than half a period
            continue
        A = (along.waves(order).T * root).T
        A -= drift @ (drift.T @ A)
        b = A.T @ rest
        out[k] = float(b @ np.linalg.lstsq(A.T @ A, b, rcond=None)[0]) / total
    return out


def seen(along: Along, signal: np.ndarray, rate: np.ndarray, orders: np.ndarray, quick: float) -> np.ndarray:
    """As `spectrum`, each order where it passes slower than `quick` rad/s, so that the signal can show it; `rate` is
    that of the angle. By the number of rows that are left.

    Rows count the more the faster they pass: time alone would count a stop, at which friction holds whatever the force,
    as many rows, and the angle alone a slow turn, which averages more noise, as no more than a fast one.
    """
    out = np.zeros(len(orders))
    rows = np.array([np.count_nonzero(rate * order < quick) for order in orders])
    for count in np.unique(rows):  # the rows of a higher order are among those of a lower one: as many are the same
        same = np.flatnonzero(rows == count)
        slow = rate * orders[same[0]] < quick
        weight = np.sqrt(np.maximum(rate[slow], 0.0))  # a moving average may round below zero
        total, square = float(weight.sum()), float(weight @ weight)
        if square > 0.0:
            out[same] = spectrum(along.at(slow), signal[slow], orders[same], np.sqrt(weight)) * total**2 / square
    return out


def peaks(grid: np.ndarray, height: np.ndarray, most: int) -> list[float]:
    """The grid's highest local maxima, highest first."""
    inner = np.flatnonzero((height > np.roll(height, 1)) & (height >= np.roll(height, -1)) & (height > 0))
    return [float(grid[i]) for i in inner[np.argsort(-height[inner])][:most]]


def orders_of(span: float, height: np.ndarray, most: int) -> list[float]:
    """Orders by `height` (ORDERS). A way of `span` rad that is no whole turn does not tell neighbours apart: those of
    the highest are among them."""
    tops = peaks(ORDERS, height, most)
    if not tops or span >= 2 * np.pi:
        return tops
    near = [order for order in (tops[0] - 1.0, tops[0] + 1.0) if order in ORDERS and order not in tops]
    return [tops[0], *near, *tops[1:]][:most]


def spots(way: np.ndarray, signal: np.ndarray, most: int, bins: int = 80) -> list[float]:
    """Places, as shares of the way, where the signal's mean stands out from that of the places around."""
    edges = np.linspace(way.min(), way.max() + 1e-12, bins + 1)
    index = np.clip(np.digitize(way, edges) - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    mean = np.bincount(index, signal, bins) / np.maximum(count, 1)
    around = np.convolve(np.pad(mean, 4, mode="edge"), np.ones(9) / 9, "valid")
    off = np.abs(mean - around) * np.sqrt(np.minimum(count, np.median(count)))
    return [float((i + 0.5) / bins) for i in np.argsort(-off)[:most]]


def jumps(error: np.ndarray, count: float) -> list[tuple[int, float]]:
    """Rows and sizes of sudden steps of the error (n,) that do not come back at once, the largest first.

    `count` is the sensor's step in the error's unit. A jump takes one tick: it stands out of the ticks around it, but
    for one more jump at most, which a vibration or a reversal that the model misses does not. Where one is sure, others
    as large may be less so; and where noise makes what they differ by, they are alike.
    """
    step = np.diff(error)
    quiet = 1.4826 * float(np.median(np.abs(step - np.median(step)))) + 0.3 * count
    found: list[tuple[int, float]] = []
    unsure: list[tuple[int, float]] = []
    for k in np.flatnonzero(np.abs(step) > max(UNSURE * quiet, 2.5 * count)):
        if not AROUND < k < len(step) - AROUND:
            continue
        near = np.sort(np.abs(np.delete(step[k - AROUND : k + AROUND + 1], AROUND)))
        if near[-1] < TWIN * abs(step[k]) < TWIN**2 * near[-1]:  # another as large, which stands out as well
            near = near[:-1]
        size = float(np.median(error[k + 1 : k + 4]) - np.median(error[k - 2 : k + 1]))
        if abs(step[k]) > 4 * np.median(near) and abs(step[k]) > 2 * near.max() and abs(size) > 0.6 * abs(step[k]):
            (found if abs(step[k]) > SURE * quiet else unsure).append((int(k) + 1, size))
    if not found:
        return []
    usual = float(np.median([abs(size) for _, size in found]))
    found += [jump for jump in unsure if abs(abs(jump[1]) - usual) < ALIKE * quiet]
    if all(abs(abs(size) - usual) < ALIKE * quiet for _, size in found):
        found = [(k, float(np.copysign(usual, size))) for k, size in found]
    return sorted(found, key=lambda jump: -abs(jump[1]))[:JUMPS]
