"""References and excitations of recordings."""

import math

import numpy as np


def rich(
    rng: np.random.Generator, n: int, Ts: float, step: float, slow: float, fast: float, reach: float
) -> np.ndarray:
    """Reference (n,) of moves, ramps, waves and dwells; `step` is a typical move, speed `slow` to `fast` (unit/s).

    Stays within +-reach. Starts at 0 with a dwell.
    """
    parts = [np.zeros(int(rng.uniform(0.3, 0.7) / Ts))]
    at = 0.0
    while sum(map(len, parts)) < n:
        kind = rng.choice(["move", "move", "move", "ramp", "ramp", "wave", "dwell"])
        size = step * math.exp(rng.uniform(-1.3, 1.0)) * rng.choice([-1.0, 1.0])
        if abs(at + size) > reach:
            size = -size
        if abs(at + size) > reach:
            size = -at
        if kind == "move":
            piece = at + size * _blend(abs(size) / fast * rng.uniform(1.0, 3.0), Ts)
        elif kind == "ramp":
            speed = slow * math.exp(rng.uniform(0.0, math.log(fast / slow)))
            piece = at + size * _trapezoid(min(max(abs(size) / speed, 0.2), 0.25 * n * Ts), Ts)
        elif kind == "wave":
            amplitude, turns = 0.5 * size, int(rng.integers(1, 4))
            period = 2.0 * math.pi * abs(amplitude) / (fast * rng.uniform(0.15, 0.6))
            period = min(max(period, 0.25), 0.15 * n * Ts)
            t = np.arange(max(int(turns * period / Ts), 1)) * Ts
            piece = at + amplitude * (1.0 - np.cos(2.0 * np.pi * t / period))
        else:
            piece = np.full(int(rng.uniform(0.2, 1.0) / Ts), at)
        parts.append(piece)
        at = float(piece[-1]) if len(piece) else at
    return np.concatenate(parts)[:n]


def production(rng: np.random.Generator, n: int, Ts: float, step: float, fast: float, reach: float) -> np.ndarray:
    """Reference (n,) of trapezoidal moves with dwells, as in production."""
    parts = [np.zeros(int(0.5 / Ts))]
    at = 0.0
    while sum(map(len, parts)) < n:
        size = step * math.exp(rng.uniform(-0.6, 0.9)) * rng.choice([-1.0, 1.0])
        if abs(at + size) > reach:
            size = -size
        if abs(at + size) > reach:
            size = -at
        piece = at + size * _trapezoid(max(abs(size) / fast, 0.15), Ts)
        parts += [piece, np.full(int(rng.uniform(0.6, 2.2) / Ts), piece[-1])]
        at = float(piece[-1])
    return np.concatenate(parts)[:n]


def _blend(length: float, Ts: float) -> np.ndarray:
    """Profile from 0 to 1 with continuous acceleration (quintic)."""
    r = np.linspace(0.0, 1.0, max(int(max(length, 0.12) / Ts), 2))
    return r**3 * (10.0 - 15.0 * r + 6.0 * r * r)


def _trapezoid(length: float, Ts: float) -> np.ndarray:
    """Profile from 0 to 1 at constant speed with short rounded ends."""
    n = max(int(length / Ts), 8)
    ends = max(int(0.15 * n), 2)
    speed = np.interp(np.arange(n), [0, ends, n - 1 - ends, n - 1], [0.0, 1.0, 1.0, 0.0])
    return np.cumsum(speed) / speed.sum()


def multisine(rng: np.random.Generator, n: int, Ts: float, rms: float, top_hz: float, slope: float) -> np.ndarray:
    """Random-phase multisine (n,) up to `top_hz`; its amplitude falls with f^-slope above `top_hz` / 20."""
    f = np.fft.rfftfreq(n, Ts)
    knee = top_hz / 20.0
    size = np.where((f > 0.3) & (f < top_hz), np.maximum(f / knee, 1.0) ** -slope, 0.0)
    x = np.fft.irfft(size * rng.standard_normal(len(f)) * np.exp(2j * np.pi * rng.random(len(f))), n)
    x *= rms / max(float(np.sqrt(np.mean(x * x))), 1e-30)
    return np.asarray(x)
