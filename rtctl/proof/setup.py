"""Setup of one case for the simulation: true machine, nominal values, law, reference and noise."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.proof.machine import NQ, NY


@dataclass
class Hidden:
    """Amplitudes of disturbances over time; the noise seed is independent of them."""

    torque_sd: np.ndarray = field(default_factory=lambda: np.zeros(NQ))  # white noise, Nm or N, held for a tick
    colour: float = 0.0  # pole of the torque noise, 0 is white
    random_sd: np.ndarray = field(default_factory=lambda: np.zeros(NQ))  # unknown random torque, Nm or N
    random_tau: float = 0.05  # s
    count_sd: np.ndarray = field(default_factory=lambda: np.zeros(NY))  # standard deviation of sensor noise, counts
    walk: np.ndarray = field(default_factory=lambda: np.zeros(NY))  # random walk of a reading, counts per root s
    lost_rate: np.ndarray = field(default_factory=lambda: np.zeros(NY))  # 1/s
    lost_counts: np.ndarray = field(default_factory=lambda: np.zeros(NY))
    jitter_s: float = 0.0  # standard deviation of the tick times, s
    jitter_skew: float = 0.0  # 0 Gaussian, 1 late ticks only (exponential)
    clock_tells: bool = False  # column t holds the true times
    spot_rate: float = 0.0  # 1/s, rate of intermittent friction
    spot_s: float = 0.2


@dataclass
class Setup:
    plant: str
    m: np.ndarray  # machine record ()
    truth: dict[str, float]
    case: dict[str, Any]
    ref: np.ndarray
    w: np.ndarray
    nodes: dict[str, int]
    sensors: list[str]
    hidden: Hidden = field(default_factory=Hidden)
    law: np.ndarray | None = None  # set where the true law is not the law of the case
    play: Any = None  # plants.Play: draws another reference and excitation of this kind
    acceleration: np.ndarray = field(default_factory=lambda: np.zeros(1))  # at the sensor's node, rad/s^2
    span: dict[str, float] = field(default_factory=dict)  # typical amplitudes: u (V), v, q at the main node

    @property
    def n(self) -> int:
        return len(self.ref)

    @property
    def Ts(self) -> float:
        return float(self.m["Ts"])


def draws(setup: Setup, seed: list[int]) -> dict[str, np.ndarray]:
    """Noise arrays for the solver from one seed; each kind of noise has its own random stream."""
    h, n, Ts = setup.hidden, setup.n, setup.Ts
    stream = [np.random.default_rng([*seed, i]) for i in range(7)]
    push = stream[0].standard_normal((n, NQ))
    if h.colour:
        push = _low_pass(push, h.colour)
    push = push * h.torque_sd
    if h.random_sd.any():
        push = push + h.random_sd * _low_pass(stream[1].standard_normal((n, NQ)), math.exp(-Ts / h.random_tau))
    extra = stream[2].standard_normal((n, NY)) * h.count_sd
    if h.walk.any():
        extra = extra + np.cumsum(stream[3].standard_normal((n, NY)), axis=0) * h.walk * math.sqrt(Ts)
    chance = stream[4].random((n, NY))
    sign = np.where(stream[4].random((n, NY)) < 0.75, 1.0, -1.0)
    lost = np.where(chance < h.lost_rate * Ts, sign * h.lost_counts, 0.0)
    late = stream[5].standard_normal(n + 1)
    if h.jitter_skew:
        late = (1 - h.jitter_skew) * late + h.jitter_skew * (stream[5].exponential(1.0, n + 1) - 1.0)
    ticks = np.arange(n + 1) * Ts + np.clip(late * h.jitter_s, -0.3 * Ts, 0.45 * Ts)
    ticks[0] = 0.0
    spot = np.zeros(n)
    if h.spot_rate:
        length = max(int(h.spot_s / Ts), 1)
        for begin in np.flatnonzero(stream[6].random(n) < h.spot_rate * Ts):
            spot[begin : begin + length] = 1.0
    return {"push": push, "extra": extra, "lost": lost, "ticks": ticks, "spot": spot}


def _low_pass(x: np.ndarray, pole: float) -> np.ndarray:
    """First-order noise of unit variance from white noise of unit variance."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([math.sqrt(1.0 - pole * pole)], [1.0, -pole], x, axis=0))
