"""Calibrated band of a healthy machine: location and spread of the residual measures of its windows.

No model is exact. A robust regression on the motion (a constant, the direction, speed, acceleration) fits the slow
residuals of the healthy machine. The remainder of this regression and the innovations of each sensor are measured in
windows. The power of each measure grows with the squares of speed and acceleration; location and spread of the
normalised measures depend on the speed of the machine.

Source: Huber & Ronchetti, Robust Statistics (2009), ch. 7 for the weights; Kennedy & O'Hagan, Bayesian calibration of
computer models, JRSS B 63 (2001) for a discrepancy that is learned beside a model.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from rtctl.config.errors import NoAnswer
from rtctl.diagnose.likelihood.likelihood import ORDER
from rtctl.diagnose.likelihood.noise import filtered, noise_of
from rtctl.watch.cusum import Thresholds, thresholds
from rtctl.watch.windows import SLIGHT, STEPS, Batch, Shape

FEWEST = 60  # windows in motion from which a band can be learned
OF_A_PACE = 60  # windows in motion for each pace (speed class) of the band
PACES = 4  # paces of a band, at most
MOVES = 0.3  # share of moving blocks, from which on a window is in motion
FASTER = 1.25  # times the fastest learned window: a faster window is not judged
LATE, LATER = 0.1, 1.5  # usual error of time: in ticks, and times the 0.9 quantile of the learned windows
HUBER = 1.5  # standard deviations, beyond which a block weighs less
ROUNDS = 10
OUTLYING = 9.0  # times its expectation, at which the square of a measure is clipped
LEAST = 1e-3  # of the mean square of a measure: its power at rest, at least
ALONG = ("push", "direction", "speed", "acceleration")  # what a missing force may be proportional to
FAINT = 0.1  # of the usual speed or acceleration: a regressor below it in a window does not determine its force
EVEN = 0.1  # of the usual speed and acceleration: largest changes of an even motion
LEAST_WEIGHT = 0.1
PER_DAY = 1.0  # false alarms in eight hours of motion


Before = tuple[np.ndarray, int]  # mean speed (followed,) of the window before, and number of even windows so far


class Measure(NamedTuple):
    """One number of a window."""

    of: str  # sensor whose innovations, or signal whose slow blocks, it measures
    what: str  # "noise", "size", or one of ALONG with the sign "+" or "-"


class Band(NamedTuple):
    """Band of a healthy machine, learned from its windows. Signals are the forces at the followed bodies and the slow
    residuals of the other sensors."""

    shape: Shape
    sensors: tuple[str, ...]
    followed: tuple[int, ...]  # numbers of the followed sensors
    grain: np.ndarray  # (followed,) STEPS steps of a sensor, as a speed of a slow block
    asked: float  # step of the reference in a slow block, from which on it moves
    units: np.ndarray  # (2, followed) usual speed and acceleration
    whitening: list[np.ndarray]  # of each sensor
    usual: np.ndarray  # (signals, len(ALONG)) regression coefficients of the healthy machine's missing force
    late: float  # s, error of the time of a row, beyond which a window is not judged
    jolt: float  # highest acceleration of the learned windows, in units of the usual acceleration
    paces: np.ndarray  # (paces,) speeds at which location and spread are known, in units of the usual speed
    growth: np.ndarray  # (3, measures) power of each measure: a constant, and coefficients of speed and acceleration
    location: np.ndarray  # (paces, measures)
    spread: np.ndarray  # (paces, measures)
    sigma: np.ndarray  # (sensors,) innovations of the healthy machine, SI
    slow_sigma: np.ndarray  # (sensors,) residual of a slow block of the healthy machine, SI
    limits: Thresholds

    @property
    def measures(self) -> list[Measure]:
        """The measures, in the order of the columns of `raw`; each of ALONG stands for two scores."""
        signals = [self.sensors[k] for k in self.followed] + self.beside
        slow = [Measure(name, what) for name in signals for what in ("size", *ALONG)]
        return [*(Measure(name, "noise") for name in self.sensors), *slow]

    @property
    def beside(self) -> list[str]:
        """Sensors that are not followed."""
        return [name for k, name in enumerate(self.sensors) if k not in self.followed]

    def signed(self) -> list[Measure]:
        """The measure of each score: those of ALONG twice, with their sign."""
        measures = self.measures
        two = [m._replace(what=m.what + sign) for sign in "+-" for m in measures if m.what in ALONG]
        return [m for m in measures if m.what not in ALONG] + two

    def moving(self, batch: Batch) -> np.ndarray:
        """Whether each block (windows, BLOCKS) is in motion, or its reference is."""
        return (np.abs(batch.v) > self.grain).any(axis=2) | (np.abs(batch.asked) > self.asked)

    def counts(self, batch: Batch) -> np.ndarray:
        """Windows (n,) in motion whose rows came in time, no faster than the learned windows by FASTER."""
        slow = (self.pace(batch) <= FASTER * self.paces[-1]) & (self.pace(batch, 1) <= FASTER * self.jolt)
        return self.in_motion(batch) & slow & ~self.untimely(batch)

    def untimely(self, batch: Batch) -> np.ndarray:
        """Windows (n,) with rows that came later than the learned rows: an error of the clock would appear as an error
        of the machine."""
        return np.asarray(batch.late > self.late)

    def in_motion(self, batch: Batch) -> np.ndarray:
        """Windows (n,) in motion."""
        return np.asarray(self.moving(batch).mean(axis=1) >= MOVES)

    def pace(self, batch: Batch, order: int = 0) -> np.ndarray:
        """Rms speed (n,) of windows in units of the usual speed; with `order` 1 rms acceleration in its usual unit."""
        return np.sqrt(np.mean(((batch.v, batch.a)[order] / self.units[order]) ** 2, axis=(1, 2)))

    def grown(self, batch: Batch) -> np.ndarray:
        """Regressors (windows, 3) of the power of a measure: 1, squared speed, squared acceleration."""
        return np.stack([np.ones(batch.size), self.pace(batch) ** 2, self.pace(batch, 1) ** 2], axis=1)

    def weights(self, batch: Batch, before: "Before | None" = None) -> tuple[np.ndarray, "Before"]:
        """Weights (n,) of windows, and the state `Before` for the next windows. Consecutive windows of an even motion
        repeat each other: the n-th of them has the weight 1/n, at least LEAST_WEIGHT."""
        mean, out = batch.v.mean(axis=1) / self.units[0], np.ones(batch.size)
        last, count = before if before is not None else (np.full(mean.shape[1], np.inf), 0)
        even = self.pace(batch, 1) < EVEN
        for k, v in enumerate(mean):
            count = count + 1 if even[k] and (np.abs(v - last) < EVEN).all() else 1
            out[k], last = max(1.0 / count, LEAST_WEIGHT), v
        return out, (last, count)

    def signals(self, batch: Batch) -> np.ndarray:
        """Slow signals (windows, BLOCKS, signals): forces, and residuals of the other sensors about their means."""
        rest = [k for k in range(len(self.sensors)) if k not in self.followed]
        n, blocks = batch.v.shape[:2]
        other = batch.e[:, :, rest].reshape(n, blocks, -1, len(rest)).mean(axis=2) if rest else np.empty((n, blocks, 0))
        return np.concatenate([batch.force, other - other.mean(axis=1, keepdims=True)], axis=2)

    def along(self, batch: Batch, signal: int) -> np.ndarray:
        """Regressors (windows, BLOCKS, len(ALONG)) of a missing force, by the motion of the body of a signal."""
        lead = min(signal, len(self.followed) - 1) if signal < len(self.followed) else 0
        v, a = batch.v[:, :, lead], batch.a[:, :, lead]
        way = np.where(np.abs(v) > self.grain[lead], np.sign(v), 0.0)
        return np.stack([np.ones_like(v), way, v / self.units[0, lead], a / self.units[1, lead]], axis=2)

    def innovations(self, batch: Batch) -> np.ndarray:
        """Standard deviation of the innovations (windows, sensors) of each window, SI."""
        return np.stack([np.std(filtered(a, batch.e[:, :, k].T), axis=0) for k, a in enumerate(self.whitening)], axis=1)

    def missing(self, batch: Batch) -> np.ndarray:
        """Signals (windows, BLOCKS, signals) less the prediction for the healthy machine in this motion."""
        signals = self.signals(batch)
        usual = [self.along(batch, s) @ self.usual[s] for s in range(signals.shape[2])]
        return np.asarray(signals - np.stack(usual, axis=2))

    def raw(self, batch: Batch) -> np.ndarray:
        """Measures (windows, measures), SI: root mean squares, and projections on each of ALONG."""
        left = self.missing(batch)
        columns = list(self.innovations(batch).T)
        for s in range(left.shape[2]):
            r, f = left[:, :, s], self.along(batch, s)
            columns.append(np.sqrt(np.mean(r**2, axis=1)))
            size = np.sqrt(np.sum(f**2, axis=1) + f.shape[1] * FAINT**2)
            columns += list((np.einsum("wb,wbf->wf", r, f) / size).T)
        return np.stack(columns, axis=1)

    def relative(self, batch: Batch) -> np.ndarray:
        """Measures (windows, measures) in units of their size at this motion; of root mean squares the logarithm."""
        raw = self.raw(batch) / np.sqrt(self.grown(batch) @ self.growth)
        signed = np.array([m.what in ALONG for m in self.measures])
        return np.where(signed, raw, np.log(np.maximum(np.abs(raw), 1e-6)))

    def scores(self, batch: Batch) -> np.ndarray:
        """Scores (windows, scores) in standard deviations of the healthy machine at this pace, ordered as `signed`."""
        pace = self.pace(batch)
        raw = self.relative(batch)
        z = np.empty_like(raw)
        for k in range(raw.shape[1]):
            z[:, k] = (raw[:, k] - np.interp(pace, self.paces, self.location[:, k])) / np.interp(
                pace, self.paces, self.spread[:, k]
            )
        signed = np.array([m.what in ALONG for m in self.measures])
        return np.concatenate([z[:, ~signed], z[:, signed], -z[:, signed]], axis=1)


def learn(batch: Batch, shape: Shape, sensors: list[str], followed: list[int], grain: np.ndarray,
          per_day: float = PER_DAY) -> Band:  # fmt: skip
    """Band learned from windows of a healthy machine; `grain` (followed,) is the step of each followed sensor, SI.

    Raises NoAnswer where too few windows are in motion.
    """
    slow = shape.slow * shape.dt
    asked = np.abs(batch.asked)
    some = asked[asked > 0.0]
    band = Band(
        shape=shape,
        sensors=tuple(sensors),
        followed=tuple(followed),
        grain=STEPS * np.maximum(grain, 1e-12) / slow,
        asked=SLIGHT * float(np.sqrt(np.mean(some**2))) if len(some) else np.inf,
        units=np.ones((2, len(followed))),
        whitening=[np.ones(1)] * len(sensors),
        usual=np.zeros((len(sensors), len(ALONG))),
        late=np.inf,
        jolt=1.0,
        paces=np.ones(1),
        growth=np.zeros((3, 0)),
        location=np.zeros((1, 0)),
        spread=np.ones((1, 0)),
        sigma=np.ones(len(sensors)),
        slow_sigma=np.ones(len(sensors)),
        limits=Thresholds(np.ones(0), per_day),
    )
    late = max(LATER * float(np.quantile(batch.late, 0.9)), LATE * shape.dt)
    band = band._replace(late=min(late, shape.dt))
    batch = batch.some(band.in_motion(batch) & ~band.untimely(batch))
    if batch.size < FEWEST:
        raise NoAnswer(
            f"the machine moved in {batch.size} windows of {shape.seconds:g} s while the band was to be learned; "
            f"{FEWEST} are needed"
        )
    units = np.stack([np.sqrt(np.mean(x**2, axis=(0, 1))) for x in (batch.v, batch.a)])
    band = band._replace(units=np.maximum(units, 1e-300))
    band = band._replace(whitening=[_whitening(batch.e[:, :, k]) for k in range(len(sensors))])
    signals = band.signals(batch)
    band = band._replace(usual=np.stack([
        _robust(band.along(batch, s).reshape(-1, len(ALONG)), signals[:, :, s].ravel())
        for s in range(signals.shape[2])
    ]))  # fmt: skip
    grown = band.grown(batch)
    band = band._replace(
        jolt=float(band.pace(batch, 1).max()),
        growth=np.stack([_power(grown, raw) for raw in band.raw(batch).T], axis=1),
    )
    band = _paced(band, batch)
    n, blocks = batch.v.shape[:2]
    slow_blocks = batch.e.reshape(n, blocks, -1, len(sensors)).mean(axis=2)
    band = band._replace(
        sigma=np.maximum(np.median(band.innovations(batch), axis=0), 1e-300),
        slow_sigma=np.maximum(1.4826 * np.median(np.abs(slow_blocks), axis=(0, 1)), 1e-300),
    )
    return band._replace(limits=thresholds(band.scores(batch), band.weights(batch)[0], shape.seconds, per_day))


def _whitening(e: np.ndarray) -> np.ndarray:
    """Whitening filter of residuals (windows, blocks), by the mean covariance of the windows."""
    middle = e - e.mean(axis=1, keepdims=True)
    return noise_of(middle.ravel(), min(ORDER, e.shape[1] // 5), 1e-300).a


def _robust(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Coefficients of a robust regression of b (n,) on the columns of A (n, k)."""
    w, found = np.ones(len(b)), np.zeros(A.shape[1])
    ridge = 1e-6 * np.diag((A**2).sum(axis=0) + 1e-12)
    for _ in range(ROUNDS):
        found = np.linalg.solve((A.T * w) @ A + ridge, (A.T * w) @ b)
        r = b - A @ found
        sigma = 1.4826 * float(np.median(np.abs(r))) + 1e-300
        w = np.minimum(1.0, HUBER * sigma / np.maximum(np.abs(r), 1e-300))
    return found


def _power(grown: np.ndarray, raw: np.ndarray) -> np.ndarray:
    """Coefficients (3,), none negative, of the squares of a measure (n,) on `grown` (n, 3), by iteratively reweighted
    least squares; squares are clipped at OUTLYING times their expectation."""
    power = raw**2
    scale = max(float(power.mean()), 1e-300)
    variance = np.full(len(raw), scale)
    found = np.array([scale, 0.0, 0.0])
    for _ in range(ROUNDS):
        found, _ = nnls(grown / variance[:, None], np.minimum(power, OUTLYING * variance) / variance)
        variance = np.maximum(grown @ found, LEAST * scale)
    found[0] = max(found[0], LEAST * scale)
    return found


def _paced(band: Band, batch: Batch) -> Band:
    """The band with location and spread of its measures by pace. The spread is that of the quartiles or, for long
    tails, of the 5 % and 95 % quantiles, widened for the standard error of few windows."""
    pace, raw = band.pace(batch), band.relative(batch)
    count = int(np.clip(batch.size // OF_A_PACE, 1, PACES))
    order = np.argsort(pace, kind="stable")
    paces, location, spread = [], [], []
    for part in np.array_split(order, count):
        low, lower, middle, upper, high = np.quantile(raw[part], (0.05, 0.25, 0.5, 0.75, 0.95), axis=0)
        paces.append(float(np.median(pace[part])))
        location.append(middle)
        spread.append(np.maximum((high - low) / 3.29, (upper - lower) / 1.349) * (1.0 + 1.0 / np.sqrt(len(part))))
    top = float(pace.max())
    if count > 1 and top > paces[-1]:  # the band reaches up to the fastest learned window
        paces.append(top)
        location.append(location[-1])
        spread.append(spread[-1])
    return band._replace(paces=np.array(paces), location=np.array(location), spread=np.maximum(np.array(spread), LEAST))
