"""Commands between samples: held, or smooth."""

import numpy as np

SLOWEST = 0.2  # lower bound of cos(pi f): a command near half the sample rate is not smooth


def half_a_tick_on(volts: np.ndarray) -> np.ndarray:
    """Command (n, drives) that, held over each tick, moves a mass at the ticks like the smooth command.

    A sampled command that no DAC holds changes between its samples. With f in cycles
    a tick, 1 / (j w)^2 over the double integrator with a hold is sinc(f)^2 / cos(pi f) and half a tick of lead. Source:
    Astrom, Hagander & Sternby, Zeros of sampled systems, Automatica 20 (1984).
    """
    f = np.fft.rfftfreq(len(volts))
    turn = np.sinc(f) ** 2 / np.maximum(np.cos(np.pi * f), SLOWEST) * np.exp(1j * np.pi * f)
    return np.fft.irfft(np.fft.rfft(volts, axis=0) * turn[:, None], len(volts), axis=0)
