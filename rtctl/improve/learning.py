"""Iterative learning between two runs of one move: the feedback's command becomes a feedforward of the next run.

    u_j+1 = Q (u_j + gain e_j + D e_j')               e_j: error of run j, taken `lead` s later

The learning filter is that of the feedback itself, so that a run removes the error within the loop's bandwidth. Q is a
zero-phase low-pass below the crossover, near which the loop amplifies and learning would diverge. A run that is worse
than the run before is not learned from: the last change of the values is halved.

Source: Bristow, Tharayil & Alleyne, A survey of iterative learning control, IEEE Control Systems Magazine 26 (2006).
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.laws.iterative_learning import MOST

UP_TO = 0.6  # crossovers up to which is learned


class Learner(NamedTuple):
    """Settings of iterative learning for one machine."""

    gain: float  # V per unit of error
    D: float  # V s per unit of error
    lead: float  # s until a command acts
    cutoff: float  # Hz
    dt: float  # s
    duration: float  # s of the move


def learner(config: Any, crossover: float, duration: float) -> Learner:
    """Learner of a config's position law whose loop crosses 1 at `crossover` Hz, over a move of `duration` s."""
    law, dt = config.law.position, 1.0 / config.loop.rate
    gain = float(getattr(law, "gain", 0.0))
    D = gain * float(getattr(law, "tau_d", 0.0) or 0.0) + float(getattr(law, "velocity_gain", 0.0) or 0.0)
    lead = dt * (0.5 + (config.loop.write == "next_tick"))
    return Learner(gain, D, lead, UP_TO * crossover, dt, duration)


def learned(by: Learner, values: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Values (n,) after a run with the error (ticks,) over the move, from those that it had."""
    from scipy.signal import butter, sosfiltfilt

    t = by.dt * np.arange(len(error))
    had = np.interp(t, np.linspace(0.0, by.duration, len(values)), values)
    ahead = np.interp(t + by.lead, t, error)
    new = had + by.gain * ahead + by.D * np.gradient(ahead, by.dt)
    low = butter(2, min(by.cutoff * by.dt * 2, 0.9), output="sos")
    new = sosfiltfilt(low, new, padlen=min(len(new) - 1, round(3 / (by.cutoff * by.dt))))
    return np.asarray(np.interp(np.linspace(0.0, by.duration, count(by)), t, new))


def count(by: Learner) -> int:
    """Number of values over the move: eight for a period of the cut-off, as many as there may be."""
    return int(np.clip(8 * by.cutoff * by.duration, 16, MOST))
