"""Friction from break-away and from constant velocities in both directions, and its Stribeck curve.

    F(v) = F_C + (F_S - F_C) exp(-(v / v_s)^2) + F_v v                                                        (8.3)

Break-away: a soft proportional law follows a slow ramp to and fro, so the force on the sticking machine grows slowly.
The break-away force is the largest force before the machine moves off. Constant velocity: the mean force over whole
turns of the capstan, 12 as in the thesis, which averages out ripple of one turn.

On the IVU both motors have friction, and the drive force along the tape is

    K_m (A/V) (u1 / R1 - u2 / R2) = tau_1 / R1 + tau_2 / R2 + tau_c / R_c

The friction of one record is that of a motor, with equal motors and no friction of the capstan. `split` estimates all
three from records at several pairs of reels. The friction of the LDU is the board's voltage, as in 12.6, and with the
amplifier's characteristic (12.3) the force at the carriage.

Source: thesis 8.1, (8.3), (8.4), figure 8.4, 12.6; Armstrong-Helouvry 1994 for break-away by a ramp.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.identify.bench import changed, counts_per_turn, need, ramps, whole
from rtctl.identify.force import friction_force, newtons, tape_force, written_force
from rtctl.identify.records import Record
from rtctl.identify.stribeck import Stribeck, stribeck
from rtctl.machines.profile import REELS, SCALE
from rtctl.machines.profile import Friction as Usual
from rtctl.machines.profiles import profile_of
from rtctl.plants import ivu

TURN = 2.0 * np.pi
WINDOW = 0.2  # s, and encoder counts in this time above which a machine moves off; compliance is slower
COUNTS = 3
RISE = 1.0  # s, least rise time from half of the break-away force to the break-away force
ALIKE_SPEED = 0.02  # relative difference below which speeds of both directions count as equal
ALIKE = 60.0  # condition number of the balance above which the pairs of reels cannot separate the motors
UNEVEN = 0.2  # relative deviation of the speed above which it was not constant


class Point(NamedTuple):
    """Friction at one velocity."""

    v: float  # rad/s of the capstan, with its sign; 0 for break-away
    force: float  # Nm of a motor (IVU) or V at the board (LDU), with its sign
    error: float  # standard error of the force
    newtons: float  # N along the tape (IVU) or at the carriage (LDU)


class Friction(NamedTuple):
    points: tuple[Point, ...]
    both: Stribeck | None  # of the mean of both directions, which cancels a spring or a slope
    forward: Stribeck | None
    backward: Stribeck | None  # with positive values
    unit: str
    refused: tuple[str, ...]  # velocities without a result, and the reason


def _usual(machine: str) -> Usual:
    found = profile_of(machine).friction
    assert found is not None
    return found


def velocity_config(config: Any, speeds: Sequence[float] | None = None, turns: float = 12.0) -> Any:
    """Config that runs at every speed (rad/s of the capstan) for `turns` turns, forward and back.

    A reel unit first winds to the smaller reel, to keep it from running empty. One extra turn is for settling.
    """
    need(config.kind, config.name, REELS, SCALE)
    way = (turns + 1.0) * TURN
    usual = _usual(config.kind)
    per_rad = usual.per_rad(config)
    if profile_of(config.kind).has(REELS):
        way *= 1.0 if config.radius.R1 < config.radius.R2 else -1.0
    steps, at = [], 0.5
    for speed in speeds or usual.speeds:
        for to in (way, 0.0):
            steps.append({"at": at, "to": to * per_rad, "ramp": speed * per_rad})
            at += abs(way) / speed + 1.0
    return changed(config, {**usual.running, "reference": {"steps": steps}})


def break_away_config(config: Any, times: int = 2, most: float | None = None, rate: float | None = None) -> Any:
    """Config that ramps the force up and down `times` times, up to `most` V at `rate` V/s.

    The law is proportional and so soft that the moving machine unloads it. Feedforward is off. During the start of the
    motion the force still grows: by 4 mV on an LDU (one code of its board), and 1 % on an IVU.
    """
    need(config.kind, config.name, REELS, SCALE)
    usual = _usual(config.kind)
    gain, most, rate = usual.gain, most or usual.most, rate or usual.rate
    changes = {**usual.soft, "safety.frozen_time": 0, "safety.following_error": 0, "law.shaper": {}}
    reach, ramp = most / gain, rate / gain
    steps, at, x = [], 0.5, 0.0
    for to in [*(reach, -reach) * times, 0.0]:
        steps.append({"at": at, "to": to, "ramp": ramp})
        at, x = at + abs(to - x) / ramp, to
    return changed(config, {**changes, "reference": {"steps": steps}})


def constant_velocity(record: Record, turns: float = 12.0) -> tuple[list[Point], list[str]]:
    """Points from every leg at constant reference speed with `turns` turns of the capstan, and refusals.

    The last whole turns of a leg count, after the transient. The standard error comes from the means of single turns.
    Raises NoAnswer where no leg is long enough.
    """
    t, (_, angle) = record["t"], _angles(record)
    force = friction_force(record)
    points: list[Point] = []
    refused: list[str] = []
    for edges, _ in _turns(record, turns, refused):
        rows = slice(edges[0], edges[-1])
        v = (angle[edges[-1] - 1] - angle[edges[0]]) / (t[edges[-1] - 1] - t[edges[0]])
        means = np.array([force[a:b].mean() for a, b in pairwise(edges)])
        error = float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else float("nan")
        points.append(Point(float(v), float(force[rows].mean()), error, newtons(record, rows)))
    if not points:
        why = "; ".join(refused) or f"no stretch of {turns:g} turns at constant speed"
        raise NoAnswer(f"{record.source}: no friction at constant velocity: {why}")
    return points, refused


def _turns(record: Record, turns: float, refused: list[str]) -> list[tuple[np.ndarray, float]]:
    """First and last rows of the last `turns` turns of every leg at constant speed, and their direction."""
    t, (ref, angle) = record["t"], _angles(record)
    found = []
    for begin, end in ramps(t, ref, least=0.5):
        direction = float(np.sign(ref[end - 1] - ref[begin]))
        to_go = direction * (angle[end - 1] - angle[begin:end])
        if to_go[0] < turns * TURN:
            if to_go[0] > TURN:
                refused.append(f"{t[begin]:.2f} s: {to_go[0] / TURN:.1f} turns at constant speed; it takes {turns:g}")
            continue
        falls = np.minimum.accumulate(to_go)
        edges = np.unique(np.searchsorted(-falls, -TURN * np.arange(int(turns), -1, -1.0)) + begin)
        most = min(counts_per_turn(record) * turns / 20, (edges[-1] - edges[0]) / 10)  # counts and ticks in a section
        pieces = np.linspace(edges[0], edges[-1] - 1, max(int(most), 3)).astype(int)
        moved = direction * np.diff(angle[pieces])
        if moved.std() > UNEVEN * moved.mean():
            v = direction * to_go[edges[0] - begin] / (t[edges[-1] - 1] - t[edges[0]])
            refused.append(f"{v:+.3g} rad/s at {t[edges[0]]:.2f} s: stick-slip instead of constant velocity")
            continue
        found.append((edges, direction))
    return found


def break_away(record: Record) -> list[Point]:
    """Mean break-away force of each direction, from every ramp on which the machine moves off.

    Raises NoAnswer where the machine never breaks away, or where the drive was at its limit.
    """
    t, ref, angle = record["t"], *_angles(record)
    force = written_force(record)
    window = round(WINDOW * (1.0 / record.dt))
    ran = np.zeros(len(angle))
    ran[window:] = angle[window:] - angle[:-window]
    points, limit, fast = [], float(record.config.law.limit.high), ""
    drives = [name for name in ("u", "u1", "u2") if name in record.columns]
    for begin, end in ramps(t, ref, least=0.05):
        direction = np.sign(ref[end - 1] - ref[begin])
        runs = direction * ran[begin:end] >= (COUNTS - 0.5) * TURN / counts_per_turn(record)
        # an amplifier with a least current kicks at a reversal of its direction, before there is a ramp force
        gone = np.flatnonzero(runs & (direction * force[begin:end] > 0.0))
        if not len(gone) or gone[0] == 0:  # it did not move off, or was moving before
            continue
        until = begin + int(gone[0]) + 1
        if any(np.abs(record[name][begin:until]).max() > 0.98 * limit for name in drives):
            raise NoAnswer(
                f"{record.source}: the drive was at its limit of {limit:g} V before it moved, at {t[until]:.2f} s"
            )
        at = begin + int(np.argmax(direction * force[begin:until]))
        low = np.flatnonzero(direction * force[begin:at] < 0.5 * direction * force[at])
        if t[at] - t[begin + (int(low[-1]) if len(low) else 0)] < RISE:
            fast = fast or f"; at {t[at]:.2f} s the force rose within less than {RISE:g} s, which is no slow ramp"
            continue
        points.append(Point(0.0, float(force[at]), float("nan"), newtons(record, slice(at, at + 1))))
    ways = [(s, [p for p in points if np.sign(p.force) == s]) for s in (1.0, -1.0)]
    if not points:
        raise NoAnswer(f"{record.source}: it never broke away from {t[0]:.2f} to {t[-1]:.2f} s{fast}")
    return [_mean(way) for _, way in ways if way]


def points_of(records: Sequence[Record], turns: float = 12.0) -> tuple[list[Point], list[str]]:
    """Points and refusals of records of either kind. Raises NoAnswer where one has neither constant speed nor ramp."""
    points: list[Point] = []
    refused: list[str] = []
    for record in records:
        try:
            moving, why = constant_velocity(whole(record), turns)
        except NoAnswer as missing:
            try:
                points += break_away(record)
            except NoAnswer:
                raise missing from None
        else:
            points += moving
            refused += why
    return points, refused


def friction(points: Sequence[Point], refused: Sequence[str], machine: str) -> Friction:
    """Friction points with fits of (8.3) to the mean of both directions and to each; None with under 3 speeds.

    A direction has a Stribeck fall only where the mean has: at another position a spring alone resembles a fall.
    """
    ahead, behind = ([(abs(p.v), abs(p.force)) for p in points if np.sign(p.force) == sign] for sign in (1.0, -1.0))
    mean = []
    for v, F in ahead:
        pairs = [G for w, G in behind if abs(w - v) <= ALIKE_SPEED * v]
        if pairs:
            mean.append((v, 0.5 * (F + float(np.mean(pairs)))))
    both = _fit(mean, True)
    fall = both is None or both.F_S is not None
    unit = _usual(machine).unit
    return Friction(tuple(points), both, _fit(ahead, fall), _fit(behind, fall), unit, tuple(refused))


def _fit(pairs: Sequence[tuple[float, float]], fall: bool) -> Stribeck | None:
    try:
        return stribeck([v for v, _ in pairs], [F for _, F in pairs], fall=fall)
    except NoAnswer:
        return None


class Split(NamedTuple):
    tau_1: float  # Nm
    tau_2: float
    tau_c: float
    half: tuple[float, float, float]  # Nm, half widths of the 95 % intervals


def split(records: Sequence[Record], turns: float = 12.0) -> Split:
    """Dry friction of both motors and of the capstan of an IVU, from constant velocities at several pairs of reels.

    Least squares of the force balance along the tape over all turns. Raises NoAnswer where the pairs are too alike.
    """
    rows, forces = [], []
    for record in records:
        force, R_c = tape_force(record), ivu.parameters(record.config.plant).R_c
        for edges, direction in _turns(record, turns, []):
            for a, b in pairwise(edges):
                rows.append([float(np.mean(1.0 / record[R][a:b])) for R in ("R1", "R2")] + [1.0 / R_c])
                forces.append(direction * float(force[a:b].mean()))
    M: np.ndarray = np.array(rows).reshape(-1, 3)
    F = np.array(forces)
    if len(M) < 4 or np.linalg.cond(M / np.abs(M).max(axis=0)) > ALIKE:
        raise NoAnswer(f"{len(records)} records have reels too alike to separate the friction of the two motors")
    tau = np.linalg.lstsq(M, F, rcond=None)[0]
    variance = float(np.sum((F - M @ tau) ** 2)) / (len(F) - 3)
    half = 2.0 * np.sqrt(np.diag(np.linalg.inv(M.T @ M)) * variance)
    return Split(float(tau[0]), float(tau[1]), float(tau[2]), (float(half[0]), float(half[1]), float(half[2])))


def _mean(points: Sequence[Point]) -> Point:
    F = np.array([p.force for p in points])
    error = float(F.std(ddof=1) / np.sqrt(len(F))) if len(F) > 1 else float("nan")
    return Point(0.0, float(F.mean()), error, float(np.mean([p.newtons for p in points])))


def _angles(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Target and encoder angle in rad of the capstan."""
    if record.profile.has(REELS):
        return record["target"], record["capstan"]
    return record["target"] / record.config.sensors.R_c, record["encoder_counts"] * (TURN / counts_per_turn(record))
