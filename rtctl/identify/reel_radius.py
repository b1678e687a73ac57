"""Reel radii from the capstan angle and the reel pulses, during motion in one direction.

    R = R_c phi_c / phi                                                                                      (5.2)
    accuracy = (2 pi / increments) / rotation                                                                (5.3)

The plain ratio uses the angles at both ends of the travel; its error is up to one pulse of the reel. The ratio between
the first and the last counted edge has only the error of the capstan rotation in a tick. This module runs the law that
measures the radii at arming of a reel unit over a recording.

The optical sensors count up in either direction, so only travel without reversal counts. Both ends of the travel are
left out: by dry friction and an elastic tape a reel starts before the capstan and stops after it.

Source: thesis 5.1, (5.2), (5.3), 6.2.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.identify.bench import changed, counts_per_turn, need
from rtctl.identify.records import Record
from rtctl.machines.profile import REELS

TURN = 2.0 * np.pi
TRAVEL = 1.9  # rad of the capstan: accuracy of 5 % at the largest reel (5.3)
LEAST = 4  # pulses; with fewer, the error of the ratio is a quarter
RUN_IN = 0.6  # rad of the capstan after and before a reversal, where tape and shafts reverse their load
BACK = 2  # counts of encoder flicker


class Radius(NamedTuple):
    R: float  # m, between edges
    half: float  # m, largest error by quantisation
    plain: float  # m, (5.2)
    accuracy: float  # relative error of the plain ratio (5.3)
    pulses: int


class Radii(NamedTuple):
    R1: Radius
    R2: Radius
    travel: float  # rad of the capstan, signed
    begin: float  # s
    end: float


def accuracy(increments: float, rotation: float) -> float:
    """Relative error of a rotation (rad) measured with `increments` per turn (5.3)."""
    return TURN / increments / abs(rotation)


def travel_for(share: float, increments: float = 209, R_max: float = 0.04, R_c: float = 0.0125) -> float:
    """Capstan angle in rad for the relative accuracy `share` at the largest reel (5.3): 1.9 rad for 5 %."""
    return TURN / increments / share * R_max / R_c


def radius_config(config: Any, travel: float = 3.8, speed: float = 0.5) -> Any:
    """Config that winds `travel` rad to reel 1 and back, at `speed` rad/s of the capstan."""
    need(config.kind, config.name, REELS)
    back = 0.5 + travel / speed + 1.0
    steps = [{"at": 0.5, "to": travel, "ramp": speed}, {"at": back, "to": 0.0, "ramp": speed}]
    return changed(config, {"reference": {"steps": steps}})


def reel_radii(record: Record, travel: float = TRAVEL) -> list[Radii]:
    """Radii from every motion of at least `travel` rad of the capstan without reversal.

    Raises NoAnswer where no motion is long enough, or where a reel gives fewer than 4 pulses in it.
    """
    need(record.kind, record.source, REELS)
    phi, n1, n2, t = (record[name] for name in ("capstan", "reel1_counts", "reel2_counts", "t"))
    found, longest = [], 0.0
    for begin, end in one_way(phi, BACK * TURN / counts_per_turn(record)):
        cut = min(RUN_IN, 0.4 * abs(phi[end - 1] - phi[begin]))
        inside = np.flatnonzero(
            (np.abs(phi[begin:end] - phi[begin]) >= cut) & (np.abs(phi[begin:end] - phi[end - 1]) >= cut)
        )
        begin, end = begin + int(inside[0]), begin + int(inside[-1]) + 1
        longest = max(longest, abs(phi[end - 1] - phi[begin]))
        if abs(phi[end - 1] - phi[begin]) >= travel:
            found.append(radii(phi[begin:end], n1[begin:end], n2[begin:end], record.config, t[begin:end]))
    if not found:
        raise NoAnswer(
            f"{record.source}: the longest way without reversal is {longest:.2f} rad; it takes {travel:g} rad"
        )
    return found


def radii(phi: np.ndarray, n1: np.ndarray, n2: np.ndarray, config: Any, t: np.ndarray) -> Radii:
    """Radii from capstan angles (rad) and pulses of one motion without reversal, all (n,)."""
    each = []
    for n, sensor in ((n1, config.sensors.reel1), (n2, config.sensors.reel2)):
        each.append(radius(phi, n, config.R_c, sensor.pulses))
    return Radii(each[0], each[1], float(phi[-1] - phi[0]), float(t[0]), float(t[-1]))


def radius(phi: np.ndarray, n: np.ndarray, R_c: float, pulses: int) -> Radius:
    """Radius from capstan angles `phi` (rad) and pulse counts `n` (both (k,)) of one motion without reversal.

    Raises NoAnswer for fewer than 4 pulses.
    """
    from rtctl.laws import reel_edges

    s = np.zeros(1, reel_edges.EDGES_STATE)[0]
    s["n"] = int(n[0])
    edges = np.flatnonzero(np.diff(n)) + 1
    for k in edges:  # between edges the law does not change its result
        reel_edges.follow.py_func(Fields(s), 0.5 * (phi[k - 1] + phi[k]), int(n[k]), 1)
    seen = int(s["n_b"] - s["n_a"])
    if seen < LEAST:
        raise NoAnswer(f"a way of {abs(phi[-1] - phi[0]):.2f} rad gives {seen} pulses of the reel; it takes {LEAST}")
    angle = TURN / pulses
    R = float(reel_edges.radius.py_func(Fields(s), R_c, angle))
    tick = 0.5 * sum(abs(phi[k] - phi[k - 1]) for k in (edges[0], edges[-1]))
    way = abs(float(s["phi_b"] - s["phi_a"]))
    turned = (n[-1] - n[0]) * angle
    plain = R_c * abs(float(phi[-1] - phi[0])) / turned
    return Radius(R, R * float(tick) / way, float(plain), float(accuracy(pulses, turned)), seen)


class Fields:
    """Wrapper of a record with its fields as attributes, as in compiled code."""

    def __init__(self, record: Any) -> None:
        object.__setattr__(self, "_record", record)

    def __getattr__(self, name: str) -> Any:
        return self._record[name]

    def __setattr__(self, name: str, value: Any) -> None:
        self._record[name] = value


def one_way(phi: np.ndarray, flicker: float) -> list[tuple[int, int]]:
    """Intervals [begin, end) of `phi` between reversals, up to `flicker`."""
    out, begin, top, way = [], 0, 0, 0.0
    for k in range(len(phi)):
        if way == 0.0:
            if abs(phi[k] - phi[begin]) > flicker:
                way = float(np.sign(phi[k] - phi[begin]))
                top = k
        elif way * (phi[k] - phi[top]) > 0.0:
            top = k
        elif way * (phi[top] - phi[k]) > flicker:
            out.append((begin, top + 1))
            begin, top, way = top, k, -way
    if way != 0.0:
        out.append((begin, top + 1))
    return out
