"""Setup of one case for the simulation: true machine, case, law, motion, noise; and arrays of one noise seed."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.signal import lfilter

from rtctl.proof.machines.arrays import NB, ND, NS

Play = Callable[[np.random.Generator], tuple[np.ndarray, np.ndarray]]


@dataclass
class Hidden:
    """Standard deviations and rates of disturbances over time."""

    push_sd: np.ndarray = field(default_factory=lambda: np.zeros(NB))  # white force, N or Nm, held for a tick
    colour: float = 0.0  # pole of the force noise; 0 is white
    random_sd: np.ndarray = field(default_factory=lambda: np.zeros(NB))  # slow random force, N or Nm
    random_tau: float = 0.1  # s
    count_sd: np.ndarray = field(default_factory=lambda: np.zeros(NS))  # quanta
    walk: np.ndarray = field(default_factory=lambda: np.zeros(NS))  # quanta per root s
    lost_rate: np.ndarray = field(default_factory=lambda: np.zeros(NS))  # 1/s
    lost: np.ndarray = field(default_factory=lambda: np.zeros(NS))  # quanta per event
    lost_both: bool = True  # counts are lost and gained
    spot_F: np.ndarray = field(default_factory=lambda: np.zeros(NB))  # intermittent dry friction, N or Nm
    spot_rate: float = 0.0  # 1/s
    spot_s: float = 0.25
    gust: np.ndarray = field(default_factory=lambda: np.zeros(NB))  # one push, N or Nm
    gust_at: float = 0.5  # share of the recording
    gust_s: float = 0.3


@dataclass
class Setup:
    topology: str
    machine: dict[str, Any]  # description with true values
    m: np.ndarray  # record ()
    law: np.ndarray  # record ()
    case: dict[str, Any]
    truth: dict[str, float]
    control: str  # sensor of the law
    base: str  # body of that sensor
    columns: list[tuple[str, float]]  # of the sensors: name, quantum
    commands: list[str]  # columns of the drives
    play: Play
    ref: np.ndarray
    w: np.ndarray
    settle: int
    how: str
    band_hz: float  # Hz, highest frequency of the excitation
    hidden: Hidden = field(default_factory=Hidden)
    seen: dict[str, np.ndarray] = field(default_factory=dict)  # trajectories of the machine without effects

    @property
    def n(self) -> int:
        return len(self.ref)

    @property
    def Ts(self) -> float:
        return float(self.m["Ts"])

    @property
    def open_loop(self) -> bool:
        return bool(self.law["file"])

    def body(self, name: str) -> int:
        return list(self.machine["bodies"]).index(name)

    def joint(self, name: str) -> int:
        return list(self.machine["joints"]).index(name)

    def drive(self, name: str) -> int:
        return list(self.machine["drives"]).index(name)

    def sensor(self, name: str) -> int:
        return list(self.machine["sensors"]).index(name)


def draws(s: Setup, seed: list[int]) -> dict[str, np.ndarray]:
    """Noise arrays push, spot (n, NB), extra, lost (n, NS) from one seed; each kind has its own random stream."""
    h, n, Ts = s.hidden, s.n, s.Ts
    stream = [np.random.default_rng([*seed, i]) for i in range(6)]
    white = stream[0].standard_normal((n, NB))
    push = (low_pass(white, h.colour) if h.colour else white) * h.push_sd
    slow = stream[1].standard_normal((n, NB))
    if h.random_sd.any():
        push = push + h.random_sd * low_pass(slow, math.exp(-Ts / h.random_tau))
    if h.gust.any():
        r = (np.arange(n) * Ts - h.gust_at * n * Ts) / h.gust_s
        push = push + np.exp(-0.5 * r * r)[:, None] * h.gust
    extra = stream[2].standard_normal((n, NS)) * h.count_sd
    if h.walk.any():
        extra = extra + np.cumsum(stream[3].standard_normal((n, NS)), axis=0) * h.walk * math.sqrt(Ts)
    chance, up = stream[4].random((n, NS)), stream[4].random((n, NS)) < 0.5
    lost = np.where(chance < h.lost_rate * Ts, np.where(up & h.lost_both, -1.0, 1.0) * h.lost, 0.0)
    spot = np.zeros((n, NB))
    if h.spot_rate:
        for begin in np.flatnonzero(stream[5].random(n) < h.spot_rate * Ts):
            spot[begin : begin + max(int(h.spot_s / Ts), 1)] = h.spot_F
    return {"push": push, "spot": spot, "extra": extra, "lost": lost}


def low_pass(x: np.ndarray, pole: float) -> np.ndarray:
    """First-order noise of unit variance from white noise of unit variance."""
    return np.asarray(lfilter([math.sqrt(1.0 - pole * pole)], [1.0, -pole], x, axis=0))


def nothing_played() -> np.ndarray:
    """Empty array of recorded commands: the law writes the commands."""
    return np.zeros((0, ND))
