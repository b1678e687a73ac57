"""Smoothed position, speed, acceleration and effort of a recording, as inverse dynamics needs them.

Source: Savitzky & Golay, Analytical Chemistry 36 (1964); Gautier, Dynamic identification of robots with power model,
ICRA (1997), for equal filters on both sides of the equation and decimation afterwards.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import savgol_filter

from rtctl.case.format1 import believed
from rtctl.diagnose.record.format1 import Record
from rtctl.diagnose.record.law_params import per_unit

WINDOW = {"ivu": 31, "ldu": 101, "axis": 41}  # rows
ORDER = 3
REST = 0.02  # share of the highest speed: below it the direction is uncertain


class States(NamedTuple):
    """Decimated states (n,) in SI."""

    t: np.ndarray
    x: np.ndarray  # capstan angle (ivu), carriage (ldu, axis)
    v: np.ndarray
    a: np.ndarray
    effort: np.ndarray  # total effort at the capstan, Nm (ivu), or at the carriage, N
    pull: np.ndarray  # sum of the absolute efforts of all motors, in the unit of `effort`
    u: np.ndarray  # command of the first drive, V
    earlier: np.ndarray  # effort one tick earlier
    slope: np.ndarray  # time derivative of the effort
    motor: np.ndarray | None  # motor's angle, rad
    capstan: np.ndarray | None  # capstan's angle, rad
    has_viscous: bool  # whether the nominal model has viscous friction
    has_coulomb: bool
    has_spring: bool
    reels: bool


def smoothed(y: np.ndarray, window: int, dt: float, derivative: int = 0) -> np.ndarray:
    """Derivative of y by local cubic polynomials (Savitzky-Golay)."""
    found: np.ndarray = savgol_filter(y, window, ORDER, deriv=derivative, delta=dt)
    return found


def states(record: Record) -> States:
    """States of a recording, with nominal gains and ratios."""
    case, dt, plant = record.case, record.dt, record.plant
    n = len(record.t)
    p, window = believed(case), WINDOW[plant]
    angle = next(iter(record.y.values())) / per_unit(case)[0]
    if next(iter(record.y)) == "speed":
        angle = np.cumsum(angle) * dt
    scale = p["R_c"] if plant == "ldu" else 1.0
    rows = slice(window, -window, max(1, window // 2))

    def at(values: np.ndarray, derivative: int = 0) -> np.ndarray:
        return smoothed(values, window, dt, derivative)[rows]

    def late(column: int, ticks: float) -> np.ndarray:
        """Effective command: delayed, and half a tick later by the hold."""
        return np.interp(np.arange(n) - ticks - 0.5, np.arange(n), record.u[:, column])

    def efforts(delay: float) -> list[np.ndarray]:
        return [gain * at(late(column, delay)) for column, gain in enumerate(gains)]

    if plant == "ivu":
        amp = case.drive.amp_per_volt
        gains = [p["K_m1"] * amp[0] * p["R_c"] / p["R1"], -p["K_m2"] * amp[1] * p["R_c"] / p["R2"]]
        motor, capstan = angle * p["R_c"] / p["R1"], angle
    elif plant == "ldu":
        gains = [p["K_m1"] * case.drive.amp_per_volt[0] * p["N"] / p["R_c"]]
        motor, capstan = angle * p["N"], angle
    else:
        gains, motor, capstan = [p.get("K", 1.0)], None, None
    dry = ("tau_F1", "tau_F2", "tau_Fc") if plant == "ivu" else ("F_c",)
    viscous = {"ivu": (), "ldu": ("B_c", "B_m", "K_m2"), "axis": ("F_v",)}[plant]
    now = efforts(case.delay_samples)
    found = States(
        t=record.t[rows] - record.t[0],
        x=at(angle) * scale, v=at(angle, 1) * scale, a=at(angle, 2) * scale,
        effort=sum(now, np.zeros(1)), pull=sum(map(np.abs, now), np.zeros(1)), u=at(late(0, case.delay_samples)),
        earlier=sum(efforts(case.delay_samples + 1.0), np.zeros(1)),
        slope=np.gradient(sum(now, np.zeros(1)), record.t[rows]),
        motor=None if motor is None else motor[rows], capstan=None if capstan is None else capstan[rows],
        has_viscous=any(p.get(name, 0.0) for name in viscous), has_coulomb=any(p.get(name, 0.0) for name in dry),
        has_spring=bool(p.get("k", 0.0)) and plant == "axis", reels=plant == "ivu",
    )  # fmt: skip
    return moving(found)


def moving(s: States) -> States:
    """States of rows in motion: dry friction at rest is undetermined."""
    rows = np.abs(s.v) > REST * np.abs(s.v).max()
    return States(*(value[rows] if isinstance(value, np.ndarray) else value for value in s))
