"""What models take off: shares of a residual, and of the force that an observer needed, over what sensors leave."""

import numpy as np

from rtctl.diagnose.calibration import QUIET
from rtctl.diagnose.likelihood.fits import Fitted


def floor(f: Fitted) -> np.ndarray:
    """Rms (sensors,), SI, at which nothing is left to explain: by what counting leaves, and what differs from one block
    to the next without a pattern."""
    restless = np.std(np.diff(f.e, axis=0), axis=0) / np.sqrt(2.0)
    return np.asarray(np.maximum(QUIET[0] * (f.like.least * np.sqrt(f.like.mean)), QUIET[1] * restless))


def silent(f: Fitted) -> bool:
    """Whether a model leaves no more than noise in any sensor."""
    return bool((np.sqrt(np.mean(f.e**2, axis=0)) <= floor(f)).all())


def poor(f: Fitted) -> float:
    """Share of the spread of a sensor that a model leaves in it, of the sensor in which it leaves most; 0 where that is
    no more than noise."""
    left = np.sqrt(np.mean(f.e**2, axis=0))
    return float(np.max(np.where(left > floor(f), left / f.like.spread, 0.0)))


def explained(base: Fitted, best: Fitted) -> float:
    """Share of the power of the residual, above the noise of the sensor, that the best model takes off.

    Noise is what counting leaves, and what differs from one block to the next without a pattern. The sensor in which
    most is missing counts.
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
    """Share of the power of what the observer had to push with that the best model takes off, of the followed body
    where most is missing; 0 where no observer follows the machine."""
    before, after = (np.concatenate([np.mean(slow**2, axis=0) for slow in f.pushes if len(slow)] or [np.zeros(1)])
                     for f in (base, best))  # fmt: skip
    c = int(np.argmax(before))
    return float(1.0 - after[c] / before[c]) if np.isfinite(after[c]) and 0.0 < before[c] < np.inf else 0.0


def shown(base: Fitted, best: Fitted) -> float:
    """Share of the power of the residual beyond sensor noise, or of the observer's force, that the best model takes
    off, of the sensor in which most is missing: at most one, and what a reader sees of an effect.

    Noise of a sensor that counts is what counting leaves; of any other, what differs from block to block.
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
    """What a further effect takes off over what all take off, rms, of the residual or of the observer's pushes, and of
    the sensor that shows most of it."""
    found = share_of(base.e, fewer.e, more.e)
    for slow in zip(base.pushes, fewer.pushes, more.pushes, strict=True):
        if len(slow[0]) and all(np.isfinite(part).all() for part in slow):
            found = max(found, share_of(*slow))
    return found


def share_of(base: np.ndarray, fewer: np.ndarray, more: np.ndarray) -> float:
    """The same of values (rows, k) under the three models."""
    further = np.sqrt(np.mean((fewer - more) ** 2, axis=0))
    whole = np.sqrt(np.mean((base - more) ** 2, axis=0))
    return float(np.max(further / np.maximum(whole, 1e-300)))
