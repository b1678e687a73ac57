"""Disturbance estimate of the record: orders, wavelengths, places and times of a missing force.

The correction that keeps a fitted model on the recorded track is a disturbance observer: up to its bandwidth it
estimates the missing force, in units of the input of the model. As a function of the angle of a shaft it shows orders,
as a function of position it shows spots and wavelengths. Sudden jumps of the error between two ticks show lost counts.

Source: Ohnishi, Shibata & Murakami, IEEE/ASME Trans. Mechatronics 1 (1996) for the observer; order tracking by least
squares on cosine and sine of the angle, since angles are not evenly sampled.
"""

from typing import NamedTuple

import numpy as np

MOST = 4  # hints of a kind, at most
JUMPS = 47  # jumps of a sensor, at most
AROUND = 8  # ticks on each side with which a jump is compared
SURE, UNSURE = 6.0, 4.0  # times the noise from tick to tick: a lone jump, and a jump beside others of its size
TWIN = 1.4  # ratio of the sizes of two neighbouring jumps, at most
ALIKE = 2.5  # times the noise from tick to tick: size difference of equal jumps, at most
ORDERS = np.arange(1.0, 61.0)  # per turn, whole: the force of a disc or a shaft repeats after each turn
FEWEST = 200  # rows: least number for a spectrum


class Along(NamedTuple):
    """Angle (n,), rad, or position (n,), m, along which orders are searched."""

    angle: np.ndarray
    by: np.ndarray | float = 1.0  # (n,) quantity to which the amplitude of a force is proportional
    motion: tuple[np.ndarray, np.ndarray] | None = None  # speed and acceleration (n,), for a reading error of the angle

    def at(self, rows: np.ndarray) -> "Along":
        """Angle, amplitude and motion in some rows."""
        by = self.by[rows] if isinstance(self.by, np.ndarray) else self.by
        motion = None if self.motion is None else (self.motion[0][rows], self.motion[1][rows])
        return Along(self.angle[rows], by, motion)

    def waves(self, order: float) -> np.ndarray:
        """Cosine and sine (n, 2) of an order, as the signal shows them.

        A reading error of a followed angle acts as a force: its shape is the second derivative of the error.
        """
        c, s = np.cos(order * self.angle), np.sin(order * self.angle)
        if self.motion is None:
            return np.stack([self.by * c, self.by * s], axis=1)
        v, a = order * self.motion[0], order * self.motion[1]
        return np.stack([-(v**2) * c - a * s, -(v**2) * s + a * c], axis=1)


def spectrum(along: Along, signal: np.ndarray, orders: np.ndarray, root: np.ndarray | float = 1.0) -> np.ndarray:
    """Share (orders,) of the variance of `signal` that each order explains, without slow drift.

    `root` is the root of the weights of the rows.
    """
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
    """Share (orders,) of the variance that each order explains, times the effective number of its rows.

    An order counts in the rows where it passes slower than `quick`, rad/s: the signal shows no faster ripple. `rate`
    (n,) is the speed of the angle, rad/s. The weight of a row is the root of this speed. Equal weights would overrate a
    stop, at which friction holds against any force. Weights by speed would underrate a slow turn, which averages more
    noise.
    """
    out = np.zeros(len(orders))
    rows = np.array([np.count_nonzero(rate * order < quick) for order in orders])
    for count in np.unique(rows):  # rows of a higher order are a subset of those of a lower: equal counts, equal rows
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
    """Orders (of ORDERS) with the highest peaks of `height` (orders,).

    A travel of `span` rad below one turn does not separate neighbouring orders: those of the highest peak are added.
    """
    tops = peaks(ORDERS, height, most)
    if not tops or span >= 2 * np.pi:
        return tops
    near = [order for order in (tops[0] - 1.0, tops[0] + 1.0) if order in ORDERS and order not in tops]
    return [tops[0], *near, *tops[1:]][:most]


def spots(way: np.ndarray, signal: np.ndarray, most: int, bins: int = 80) -> list[float]:
    """Places, as shares of the travel, where the mean of the signal deviates most from its surroundings."""
    edges = np.linspace(way.min(), way.max() + 1e-12, bins + 1)
    index = np.clip(np.digitize(way, edges) - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    mean = np.bincount(index, signal, bins) / np.maximum(count, 1)
    around = np.convolve(np.pad(mean, 4, mode="edge"), np.ones(9) / 9, "valid")
    off = np.abs(mean - around) * np.sqrt(np.minimum(count, np.median(count)))
    return [float((i + 0.5) / bins) for i in np.argsort(-off)[:most]]


def jumps(error: np.ndarray, count: float) -> list[tuple[int, float]]:
    """Rows and sizes of sudden lasting steps of the error (n,), the largest first.

    `count` is the step of the sensor in the unit of the error. A jump takes one tick and exceeds the ticks around it,
    with one further jump among them at most. A vibration or a reversal that the model lacks does not exceed its
    neighbours so. Beside a sure jump, jumps of about its size count from a lower threshold. Jumps whose sizes differ
    only by noise get one size.
    """
    step = np.diff(error)
    quiet = 1.4826 * float(np.median(np.abs(step - np.median(step)))) + 0.3 * count
    found: list[tuple[int, float]] = []
    unsure: list[tuple[int, float]] = []
    for k in np.flatnonzero(np.abs(step) > max(UNSURE * quiet, 2.5 * count)):
        if not AROUND < k < len(step) - AROUND:
            continue
        near = np.sort(np.abs(np.delete(step[k - AROUND : k + AROUND + 1], AROUND)))
        if near[-1] < TWIN * abs(step[k]) < TWIN**2 * near[-1]:  # one further jump of about this size
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
