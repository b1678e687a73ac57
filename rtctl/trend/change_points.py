"""Change points of a series: Bayes factors of a shift, of two shifts, and of a drift, against a stationary series.

The level and the scatter of the series are integrated out under their invariant priors, so a Bayes factor does not
depend on unit or scatter, and its mean over stationary series is one. An alarm needs a posterior probability of SURE,
so by Markov's inequality at most ODDS (1 - SURE) / SURE of the trends of stationary machines alarm.

Source: Adams & MacKay, Bayesian online changepoint detection (2007) and Fearnhead, Exact and efficient Bayesian
inference for multiple changepoint problems, Stat. Comput. 16 (2006), for the positions; Liang et al., Mixtures of g
priors, JASA 103 (2008), for the sizes; Perez-Ortiz et al., E-statistics, group invariance and anytime-valid testing,
Ann. Stat. 52 (2024), for the bound.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from rtctl.trend.noise_models import Whitened, whitened

SHIFT, DRIFT, PAIR = "shift", "drift", "pair"
ODDS = 0.2  # prior odds of any change, in all series of a trend together
KINDS = {SHIFT: 0.5, PAIR: 0.25, DRIFT: 0.25}  # prior shares
SIZES = (1.0, 3.0, 10.0, 30.0)  # prior standard deviations of a change, in scatters of a record
SURE = 0.95  # least posterior probability of a reported change
FEWEST, SIDE = 8, 3  # records of a series, and on each side of a shift
MOST = 240  # records that are judged one by one; of more, neighbours are averaged
CHANGES = 6  # of a series
Z90 = 1.645


class Change(NamedTuple):
    """A change of a series."""

    kind: str  # shift or drift
    probability: float
    first: int  # record with which the shift most probably begins; the first of a drift
    earliest: int  # 90 % interval of it
    latest: int
    size: float  # of the series, over its whole length for a drift
    low: float  # 90 % interval
    high: float


class Candidates(NamedTuple):
    """Log Bayes factors of one further change, given the known changes."""

    shift: np.ndarray  # (n - 1,)
    pair: np.ndarray  # (n - 1, n - 1) upper triangle
    drift: float
    odds: float  # log of the prior odds

    @property
    def totals(self) -> dict[str, float]:
        """Log posterior odds of each kind of change."""
        shares = {kind: self.odds + float(np.log(share)) for kind, share in KINDS.items()}
        return {
            SHIFT: shares[SHIFT] + _mean(self.shift),
            PAIR: shares[PAIR] + _mean(self.pair),
            DRIFT: shares[DRIFT] + self.drift,
        }


def _mean(logs: np.ndarray) -> float:
    """Log of the mean of exponentials of the finite `logs`."""
    possible = logs[np.isfinite(logs)]
    return float(logsumexp(possible) - np.log(len(possible))) if len(possible) else -np.inf


def changes(y: np.ndarray, s: np.ndarray, at: np.ndarray, series: int = 1) -> tuple[list[Change], float]:
    """Changes of a series y (n,) of estimates with standard deviations s (n,) at increasing places `at` (n,), in order
    of place, and the posterior probability of any change. `series` is the number of tested series. A series of fewer
    than FEWEST has no changes."""
    if len(y) < FEWEST or not np.ptp(y) > 0.0:
        return [], 0.0
    y, s, at, begins = merged(y, s, at)
    models = whitened(y, s, at)
    odds = float(np.log(ODDS / series))
    known: list[int] = []  # shift columns; -1: the drift
    any_ = None
    while len(known) < CHANGES:
        found = candidates(models, known, odds)
        totals = found.totals
        together = float(logsumexp(list(totals.values())))
        any_ = probability(together) if any_ is None else any_
        if probability(together) < SURE:
            break
        kind = max(totals, key=lambda one: totals[one])
        if kind == DRIFT:
            known.append(-1)
        elif kind == SHIFT:
            known.append(int(np.argmax(found.shift)))
        else:
            known += [int(k) for k in np.unravel_index(np.argmax(found.pair), found.pair.shape)]
    out = [judged(models, known, number, odds, begins) for number in range(len(known))]
    return sorted((one for one in out if one.probability >= SURE), key=lambda one: one.first), any_ or 0.0


def probability(log_odds: float) -> float:
    """Probability of log odds."""
    return float(1.0 / (1.0 + np.exp(-np.clip(log_odds, -700.0, 700.0))))


def merged(y: np.ndarray, s: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The series with neighbours averaged where it has more than MOST records, and the first record of each average."""
    n = len(y)
    size = -(-n // MOST)
    begins = np.arange(0, n, size)
    if size == 1:
        return y, s, at, begins
    weight = 1.0 / s**2
    total = np.add.reduceat(weight, begins)
    mean = np.add.reduceat(weight * y, begins) / total
    return mean, 1.0 / np.sqrt(total), np.add.reduceat(at, begins) / np.diff([*begins, n]), begins


def candidates(models: list[Whitened], known: list[int], odds: float) -> Candidates:
    """Log Bayes factors of one further shift, of two, or of a drift, given the `known` changes."""
    n = len(models[0].y)
    each = [_under(model, known) for model in models]
    base = logsumexp([one[0] for one in each])
    shift = logsumexp([one[1] for one in each], axis=0) - base
    pair = logsumexp([one[2] for one in each], axis=0) - base
    drift = float(logsumexp([one[3] for one in each]) - base)
    k = np.arange(n - 1)
    edges = np.array([-1, *sorted(c for c in known if c >= 0), n - 1])
    near = np.min(np.abs(k[:, None] - edges[None, :]), axis=1) < SIDE
    shift = np.where(near, -np.inf, shift)
    apart = (k[None, :] - k[:, None] >= SIDE) & ~near[:, None] & ~near[None, :]
    pair = np.where(apart, pair, -np.inf)
    return Candidates(shift, pair, -np.inf if -1 in known else drift, odds)


def _under(model: Whitened, known: list[int]) -> tuple[float, np.ndarray, np.ndarray, float]:
    """Log marginal likelihoods, up to a constant, under one noise model: of no further change, of a shift at each
    place (n - 1,), of two (n - 1, n - 1), and of a drift."""
    y, X, line, base, dof = _projected(model, known)
    S = float(y @ y)
    c, q = X.T @ y, np.einsum("ij,ij->j", X, X)
    G = X.T @ X
    shift, pair, drift = [], [], []
    for g in SIZES:
        p = 1.0 / g**2
        shift.append(_log(S - c**2 / (q + p), S, dof) - 0.5 * np.log1p(q / p))
        a, d = (q + p)[:, None], (q + p)[None, :]
        det = np.maximum(a * d - G**2, 1e-12)
        gain = (d * c[:, None] ** 2 - 2.0 * G * np.outer(c, c) + a * c[None, :] ** 2) / det
        pair.append(_log(S - gain, S, dof) - 0.5 * np.log(det / p**2))
        t, r = float(line @ y), float(line @ line)
        drift.append(float(_log(np.array(S - t**2 / (r + p)), S, dof)) - 0.5 * float(np.log1p(r / p)))
    few = np.log(len(SIZES))
    alone = base - 0.5 * dof * np.log(S)
    return (
        alone,
        base + logsumexp(shift, axis=0) - few,
        base + logsumexp(pair, axis=0) - few,
        float(base + logsumexp(drift) - few),
    )


def _log(left: np.ndarray, whole: float, dof: int) -> np.ndarray:
    """Log likelihood of residual sums of squares, with the scatter integrated out."""
    return np.asarray(-0.5 * dof * np.log(np.maximum(left, 1e-9 * whole)))


def _projected(model: Whitened, known: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, int]:
    """Series, shifts and drift projected off the level and the known changes, the log volume of the model less that of
    these, and the residual degrees of freedom."""
    beside = np.stack([model.ones, *(model.line if k < 0 else model.steps[:, k] for k in known)], axis=1)
    Q, R = np.linalg.qr(beside)
    volume = float(np.sum(np.log(np.maximum(np.abs(np.diag(R)), 1e-12))))
    y, X, line = (v - Q @ (Q.T @ v) for v in (model.y, model.steps, model.line))
    return y, X, line, model.volume - volume, len(model.y) - beside.shape[1]


def judged(models: list[Whitened], known: list[int], number: int, odds: float, begins: np.ndarray) -> Change:
    """One of the known changes, given all others: its posterior probability, place and size."""
    others = known[:number] + known[number + 1 :]
    found = candidates(models, others, odds)
    if known[number] < 0:
        total = odds + np.log(KINDS[DRIFT]) + found.drift
        size, half = _size(models, others, -1)
        return Change(
            DRIFT, probability(total), int(begins[0]), int(begins[0]), int(begins[-1]), size, size - half, size + half
        )
    total = odds + np.log(KINDS[SHIFT]) + _mean(found.shift)
    weight = np.exp(found.shift - found.shift.max())
    below = np.cumsum(weight) / weight.sum()
    k = int(np.argmax(found.shift))
    earliest, latest = (int(np.searchsorted(below, level)) for level in (0.05, 0.95))
    size, half = _size(models, others, k)
    first, earliest, latest = (int(begins[min(i + 1, len(begins) - 1)]) for i in (k, earliest, latest))
    return Change(SHIFT, probability(total), first, earliest, latest, size, size - half, size + half)


def _size(models: list[Whitened], others: list[int], k: int) -> tuple[float, float]:
    """Size of a change and half width of its 90 % interval, over all noise models by their weights."""
    logs, means, variances = [], [], []
    for model in models:
        y, X, line, base, dof = _projected(model, others)
        x = line if k < 0 else X[:, k]
        S, c, q = float(y @ y), float(x @ y), float(x @ x)
        left = max(S - c**2 / q, 1e-9 * S)
        logs.append(base - 0.5 * dof * np.log(left) - 0.5 * np.log(q))
        means.append(c / q)
        variances.append(left / max(dof - 1, 1) / q)
    weight = np.exp(np.array(logs) - max(logs))
    weight /= weight.sum()
    mean = float(weight @ means)
    return mean, Z90 * float(np.sqrt(weight @ (np.array(variances) + (np.array(means) - mean) ** 2)))
