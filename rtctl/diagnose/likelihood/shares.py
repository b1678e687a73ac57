"""Explained shares of the power of a residual, and of the observer's force, above sensor noise."""

import numpy as np

from rtctl.diagnose.calibration import QUIET
from rtctl.diagnose.likelihood.fits import Fitted


def floor(f: Fitted) -> np.ndarray:
    """Noise floor (sensors,), rms, SI: the larger of counting noise and noise from block to block, times QUIET."""
    restless = np.std(np.diff(f.e, axis=0), axis=0) / np.sqrt(2.0)
    return np.asarray(np.maximum(QUIET[0] * (f.like.least * np.sqrt(f.like.mean)), QUIET[1] * restless))


def silent(f: Fitted) -> bool:
    """Whether the residual of every sensor is at its noise floor."""
    return bool((np.sqrt(np.mean(f.e**2, axis=0)) <= floor(f)).all())


def poor(f: Fitted) -> float:
    """Largest share of the spread of a sensor that its residual has, rms; 0 where residuals are at the noise floor."""
    left = np.sqrt(np.mean(f.e**2, axis=0))
    return float(np.max(np.where(left > floor(f), left / f.like.spread, 0.0)))


def explained(base: Fitted, best: Fitted) -> float:
    """Share of the power of the residual, above the noise floor, that the best model explains.

    The sensor with the largest ratio of residual to noise floor counts. The share is 1 where the best model reaches the
    floor.
    """
    least = floor(best)
    before = np.sqrt(np.mean(base.e**2, axis=0))
    after = np.sqrt(np.mean(best.e**2, axis=0))
    c = int(np.argmax(before / least))
    excess = before[c] ** 2 - least[c] ** 2
    if excess <= 0.0 or after[c] <= least[c]:
        return 1.0
    return float((before[c] ** 2 - after[c] ** 2) / excess)


def explained_force(base: Fitted, best: Fitted) -> float:
    """Share of the power of the observer's force that the best model explains, of one followed body.

    The followed body with the largest force counts. The share is 0 where no observer follows the machine.
    """
    before, after = (np.concatenate([np.mean(slow**2, axis=0) for slow in f.pushes if len(slow)] or [np.zeros(1)])
                     for f in (base, best))  # fmt: skip
    c = int(np.argmax(before))
    return float(1.0 - after[c] / before[c]) if np.isfinite(after[c]) and 0.0 < before[c] < np.inf else 0.0


def shown(base: Fitted, best: Fitted) -> float:
    """Share, at most 1, of the power of the residual above noise, or of the observer's force, that is explained.

    The sensor with the largest ratio of residual to noise counts, and the larger of both shares. The noise is counting
    noise for a sensor that counts, and noise from block to block for any other.
    """
    counts = np.array([base.like.sim.record.grain[name] > 0.0 for name in base.like.sim.channels])
    restless = np.std(np.diff(best.e, axis=0), axis=0) / np.sqrt(2.0)
    noise = np.where(counts, base.like.least * np.sqrt(base.like.mean), restless) ** 2
    before, after = np.mean(base.e**2, axis=0), np.mean(best.e**2, axis=0)
    c = int(np.argmax(before / noise))
    excess = before[c] - noise[c]
    seen = float((before[c] - after[c]) / excess) if excess > 0.0 else 0.0
    return min(max(seen, explained_force(base, best)), 1.0)


def amplitude(base: Fitted, fewer: Fitted, more: Fitted) -> float:
    """Largest ratio, rms, of the change by a further effect to the change by all effects.

    The ratio is over sensors of the residual and followed bodies of the observer's force.
    """
    found = share_of(base.e, fewer.e, more.e)
    for slow in zip(base.pushes, fewer.pushes, more.pushes, strict=True):
        if len(slow[0]) and all(np.isfinite(part).all() for part in slow):
            found = max(found, share_of(*slow))
    return found


def share_of(base: np.ndarray, fewer: np.ndarray, more: np.ndarray) -> float:
    """Largest ratio, rms, of the change by a further effect to that by all, over columns of values (rows, k)."""
    further = np.sqrt(np.mean((fewer - more) ** 2, axis=0))
    whole = np.sqrt(np.mean((base - more) ** 2, axis=0))
    return float(np.max(further / np.maximum(whole, 1e-300)))
