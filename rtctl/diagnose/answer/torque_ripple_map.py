"""Torque ripple map: missing torque of a rotary axis over one turn, from cogging, ripple and other periodic causes.

For a known drive torque the missing torque is

    tau = M x'' - K u + F_v x' + F_c sign(x') + k x

with x smoothed by a zero-phase filter up to the highest order at the speed of the axis. Averaged over the angle, torque
that repeats with the turn remains and all other torque averages out. Each visit of a place counts once, since
neighbouring rows are not independent; the band comes from the scatter of the visits. A single turn does not show which
torque repeats; its band is the residual of a series of the strongest orders.

Source: Fyfe & Munck, Analysis of computed order tracking, Mechanical Systems and Signal Processing 11 (1997); Piccoli &
Yim, Anticogging: torque ripple suppression, modeling and parameter selection, Int. J. Robotics Research 35 (2016).
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import butter, sosfiltfilt
from scipy.stats import t as student

from rtctl.case.quantities import of_case
from rtctl.diagnose.model.by_symbol import Model
from rtctl.diagnose.record.format1 import Record
from rtctl.diagnose.search.disturbance_estimate import Along, peaks, spectrum

PLACES = 360  # places over the turn
FINEST = 60.0  # highest order, periods a turn
SLOWEST, FASTEST = 2.0, 0.1  # Hz, and share of the sample rate: bounds of the cutoff of the smoothing
SETTLE = 0.5  # s at either end that are excluded: the smoothing is one-sided there
MOVES = 0.2  # of the median speed, least speed of a row that counts
VISITS = 3  # visits of a place, at least, for a band by their scatter
ORDERS = np.arange(1.0, FINEST + 1)
TOLD = 8  # reported orders, at most


class Order(NamedTuple):
    """Component of the torque with `order` periods a turn."""

    order: float
    amplitude: float  # Nm
    share: float  # of the variance of the torque, each order fitted alone


class Turn(NamedTuple):
    """Torque over the turn; nan at unvisited places."""

    angle: np.ndarray  # (PLACES,) rad, middles
    torque: np.ndarray  # (PLACES,) Nm, on the axis in the direction of its angle, without its mean
    band: np.ndarray  # (PLACES,) Nm, half width, 95 %
    visits: np.ndarray  # (PLACES,) number of visits
    orders: tuple["Order", ...]  # largest first
    turns: float  # range of the angle, turns


def over_turn(record: Record, model: Model) -> Turn | None:
    """Torque ripple map under `model`; None for an axis that is not rotary, or hardly moved."""
    if not turns(record) or "M" not in model.base or "K" not in model.base:
        return None
    rows = slice(round(SETTLE / record.dt), len(record.t) - round(SETTLE / record.dt))
    x, v, torque = missing(record, model)
    x, v, torque = x[rows], v[rows], torque[rows]
    usual = float(np.median(np.abs(v[v != 0.0]))) if v.any() else 0.0
    moves = np.abs(v) > MOVES * usual
    if not usual or np.count_nonzero(moves) < PLACES:
        return None
    x, way, torque = x[moves], np.sign(v[moves]), torque[moves]
    for side in (-1.0, 1.0):  # friction depends on direction and not on the angle
        if (way == side).any():
            torque[way == side] -= torque[way == side].mean()
    place = np.floor(np.mod(x, 2 * np.pi) / (2 * np.pi) * PLACES).astype(int) % PLACES
    visits, sums = visited(place, moves, torque)
    found, counts = mean_of(visits, sums)
    told = amplitudes(x, torque)
    many = counts >= VISITS
    scatter = np.sqrt(np.bincount(visits, (sums - found[visits]) ** 2, PLACES) / np.maximum(counts - 1, 1))
    band = student.ppf(0.975, np.maximum(counts - 1, 1)) * scatter / np.sqrt(np.maximum(counts, 1))
    band[~many] = 1.96 * float(np.std(torque - series(x, torque, [o.order for o in told])))
    band[counts == 0] = np.nan
    middles = (np.arange(PLACES) + 0.5) / PLACES * 2 * np.pi
    return Turn(middles, found, band, counts, told, float(np.ptp(x)) / (2 * np.pi))


def turns(record: Record) -> bool:
    """Whether the record is of a rotary axis with a measured angle."""
    return of_case(record.case).rotary and "x" in record.y


def missing(record: Record, model: Model) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smoothed angle, speed and missing torque, each (n,), rad, rad/s, Nm."""
    b, x = model.base, np.asarray(record.y["x"], float)
    pace = float(np.median(np.abs(np.gradient(x, record.dt)[np.gradient(x) != 0]))) if np.ptp(x) else 0.0
    rate = 1.0 / record.dt
    cut = float(np.clip(FINEST * pace / (2 * np.pi), SLOWEST, FASTEST * rate))
    smooth = butter(2, cut, fs=rate, output="sos")  # applied forwards and backwards: zero phase
    x, u = sosfiltfilt(smooth, x), sosfiltfilt(smooth, record.u[:, 0])
    v = np.gradient(x, record.dt)
    own = b["M"] * np.gradient(v, record.dt) + b.get("F_v", 0.0) * v + b.get("k", 0.0) * x
    return x, v, own + b.get("F_c", 0.0) * np.sign(v) - b["K"] * u


def visited(place: np.ndarray, moves: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place and mean torque of each visit, (visits,) each: consecutive rows at one place."""
    row = np.flatnonzero(moves)
    new = np.concatenate(([True], (np.diff(place) != 0) | (np.diff(row) > 1)))
    number = np.cumsum(new) - 1
    return place[new], np.bincount(number, torque) / np.bincount(number)


def mean_of(visits: np.ndarray, sums: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean torque over the visits of each place, nan without visits, and number of visits, (PLACES,) each."""
    counts = np.bincount(visits, minlength=PLACES)
    with np.errstate(invalid="ignore"):
        return np.bincount(visits, sums, PLACES) / np.where(counts, counts, np.nan), counts


def amplitudes(x: np.ndarray, torque: np.ndarray) -> tuple[Order, ...]:
    """Strongest orders of `torque` (n,), Nm, over the angle `x` (n,), rad; largest first."""
    thin = max(1, len(x) // 8000)
    height = spectrum(Along(x[::thin]), torque[::thin], ORDERS)
    found = peaks(ORDERS, height, TOLD)
    told = [Order(o, float(np.hypot(*wave(x, torque, o))), float(height[np.argmin(abs(ORDERS - o))])) for o in found]
    return tuple(sorted(told, key=lambda one: -one.amplitude))


def wave(x: np.ndarray, torque: np.ndarray, order: float) -> np.ndarray:
    """Cosine and sine part (2,) of one order, Nm."""
    A = np.stack([np.cos(order * x), np.sin(order * x), np.ones_like(x)], axis=1)
    return np.linalg.lstsq(A, torque, rcond=None)[0][:2]


def series(x: np.ndarray, torque: np.ndarray, orders: list[float]) -> np.ndarray:
    """Fit (n,) of the torque by a series of these orders, Nm."""
    A = np.column_stack([np.ones_like(x), *(f(order * x) for order in orders for f in (np.cos, np.sin))])
    return A @ np.linalg.lstsq(A, torque, rcond=None)[0]
