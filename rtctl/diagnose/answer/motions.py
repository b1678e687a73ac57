"""Menu of motions of an experiment, each a table of knots within the limits of travel and speed.

Every motion begins at 0, the start of the recording, and ends at rest. Corners are rounded to the acceleration of the
recording, so that the machine strikes nothing that it did not strike in the recording.

Source: constant speeds of thesis 8.1 and 12.3; odd random-phase multisine of Pintelon & Schoukens, System
Identification (2012), section 4.3; reversals within the presliding range of Armstrong-Helouvry (1991), chapter 3.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.answer.si_format import nice

MARGIN = 0.02  # share of the travel that is kept free at each end
CORNER = 4  # knots in a change of speed
KNOTS = 900  # knots of one level of the multisine, about
PERIOD = (1.0, 4.0)  # s, shortest and longest period of the multisine
TICKS = 2000  # ticks in a period within PERIOD
LINES = 100  # highest frequency of the multisine times its period
DITHER = 40  # frequency of the dither times the period of the multisine
FASTEST = 0.05  # of the sample rate, highest frequency of multisine and dither
LEVELS = (0.3, 1.0)  # amplitudes of the multisine over the largest
SPEEDS = (0.08, 0.3, 0.9)  # constant speeds over the highest of the recording
WORK = 30.0  # s, duration of the warm-up


class Limits(NamedTuple):
    """Limits of travel, speed and command that the recording shows. Positions are relative to its start."""

    unit: str  # of the reference
    command_unit: str
    dt: float  # s
    low: float
    high: float
    speed: float
    acceleration: float
    resolution: float  # smallest step that the sensor shows, in `unit`
    command: float  # largest command, in `command_unit`

    @property
    def period(self) -> float:
        """Period of the multisine, s."""
        return float(np.clip(TICKS * self.dt, *PERIOD))

    @property
    def span(self) -> float:
        """Travel without its margins."""
        return (1.0 - 2 * MARGIN) * (self.high - self.low)

    @property
    def far(self) -> tuple[float, float]:
        """Both ends of the travel less the margin, the farther from the start first."""
        room = MARGIN * (self.high - self.low)
        ends = self.low + room, self.high - room
        return ends if abs(ends[0]) > abs(ends[1]) else ends[::-1]


class Motion(NamedTuple):
    name: str
    words: str
    knots: np.ndarray  # (k, 2): s, and rad or m
    repeat: float | None  # s
    seconds: float  # duration, s

    def reference(self, t: np.ndarray) -> np.ndarray:
        """Reference (n,) in the unit of the limits at times `t` (n,), s from the start of the motion."""
        if self.repeat is not None:
            t = np.mod(t, self.repeat)
        return np.interp(t, self.knots[:, 0], self.knots[:, 1])


class Path:
    """Table of knots under construction, from rest at 0."""

    def __init__(self, limits: Limits):
        self.limits = limits
        self.knots = [(0.0, 0.0)]

    @property
    def at(self) -> float:
        """Last position."""
        return self.knots[-1][1]

    @property
    def time(self) -> float:
        """Last time, s."""
        return self.knots[-1][0]

    def rest(self, seconds: float) -> "Path":
        """Append a rest of `seconds` s."""
        self.knots.append((self.time + seconds, self.at))
        return self

    def move(self, to: float, speed: float) -> "Path":
        """Append a move to a position with a trapezoidal speed at the acceleration of the limits."""
        way, a = to - self.at, self.limits.acceleration
        if abs(way) < 1e-12:
            return self
        v = min(speed, self.limits.speed, np.sqrt(a * abs(way)))
        rise, whole = v / a, abs(way) / v + v / a
        start, origin, sign = self.time, self.at, np.sign(way)
        for t in np.linspace(0.0, rise, CORNER + 1)[1:]:
            self.knots.append((start + t, origin + sign * 0.5 * a * t**2))
        for t in np.linspace(rise, 0.0, CORNER + 1):
            self.knots.append((start + whole - t, to - sign * 0.5 * a * t**2))
        return self

    def curve(self, t: np.ndarray, r: np.ndarray) -> "Path":
        """Append points relative to the last knot."""
        start, origin = self.time, self.at
        self.knots += [(start + a, origin + b) for a, b in zip(t, r, strict=True)]
        return self

    def done(self, name: str, words: str, repeat: float | None = None, seconds: float | None = None) -> Motion:
        """Motion of the table, without repeated knots."""
        kept = [self.knots[0]]
        kept += [b for a, b in zip(self.knots, self.knots[1:], strict=False) if b[0] - a[0] > 1e-9]
        return Motion(name, words, np.array(kept), repeat, kept[-1][0] + 0.5 if seconds is None else seconds)


def stretch(limits: Limits, way: float) -> tuple[float, float]:
    """Start and end of a move of at most length `way` inside the travel, from 0 towards the farther end if possible."""
    far, near = limits.far
    way = min(way, limits.span)
    side = np.sign(far - near) or 1.0
    lowest, highest = sorted((near, far))
    first = float(np.clip(0.0, lowest, highest))
    if not lowest <= first + side * way <= highest:
        first = far - side * way
    return first, first + side * way


def slow_ramp(limits: Limits, ease: float) -> Motion:
    """Slow reversals through zero speed, three times in both directions."""
    v, half = 0.12 * ease * limits.speed, 3.0
    v = min(v, limits.span / (0.5 * half))
    a, b = stretch(limits, 0.5 * v * half)
    path = Path(limits).rest(0.5).move(a, 0.3 * limits.speed).rest(0.5)
    t = np.linspace(0.0, half, 17)[1:]
    rise = 0.5 * v * (t - half / (2 * np.pi) * np.sin(2 * np.pi * t / half))
    for _ in range(3):  # there and back; the speed is zero at each end, and little around it
        path.curve(t, np.sign(b - a) * rise).curve(t, -np.sign(b - a) * rise)
    words = (
        f"Move slowly back and forth through zero speed, six times over {nice(abs(b - a), limits.unit)}, never faster "
        f"than {nice(v, limits.unit + '/s')}."
    )
    return path.done("slow_ramp", words)


def constant_speeds(limits: Limits, ease: float) -> Motion:
    """Three speeds over more than a decade, each both ways."""
    path = Path(limits).rest(0.5)
    used = []
    for share in SPEEDS:
        v = share * ease * limits.speed
        way = min(limits.span, 2.5 * v + v**2 / limits.acceleration)
        v = min(v, np.sqrt(0.5 * limits.acceleration * way))
        a, b = stretch(limits, way)
        path.move(a, 0.3 * limits.speed).rest(0.3)
        for _ in range(2 if way / v < 1.5 else 1):
            path.move(b, v).rest(0.3).move(a, v).rest(0.3)
        used.append(nice(v, limits.unit + "/s"))
    words = f"Move at three constant speeds, {used[0]}, {used[1]} and {used[2]}, each of them in both directions."
    return path.done("constant_speeds", words)


def steps_with_rests(limits: Limits, ease: float) -> Motion:
    """Quick moves of several lengths, each followed by a second of rest."""
    way = min(limits.span, ease * limits.speed)
    a, b = stretch(limits, way)
    path = Path(limits).rest(0.5).move(a, 0.3 * limits.speed).rest(1.0)
    for share in (0.1, 0.4, 1.0):
        for to in (a + share * (b - a), a) * 2:
            path.move(to, ease * limits.speed).rest(1.0)
    words = (
        f"Make quick moves of {nice(0.1 * way, limits.unit)}, {nice(0.4 * way, limits.unit)} and "
        f"{nice(way, limits.unit)} to and fro, with one second of rest after each."
    )
    return path.done("steps_with_rests", words)


def multisine(limits: Limits, ease: float) -> Motion:
    """Odd random-phase multisine, amplitude falling with frequency, at two levels in turn."""
    T, ticks = limits.period, round(limits.period / limits.dt)
    spacing = max(1, int(np.ceil(ticks / KNOTS)))
    n = max(ticks // spacing, 32)
    T = n * spacing * limits.dt
    highest = min(LINES / limits.period, FASTEST / limits.dt, 0.2 / (spacing * limits.dt))
    lines = np.arange(n // 2 + 1)
    used = (lines % 2 == 1) & (lines / T <= max(highest, 3.5 / T))
    phases = np.random.default_rng(1).random(len(lines))
    x = np.fft.irfft(np.where(used, np.exp(2j * np.pi * phases) / np.maximum(lines, 1), 0.0), n)
    x = np.roll(x, -int(np.argmax(x)))  # starts at its peak, at rest: the levels join there
    x = (x[0] - np.append(x, x[0])) / np.ptp(x)
    steepest = np.abs(np.diff(x)).max() / (spacing * limits.dt)
    way = ease * min(0.5 * limits.span, 0.4 * limits.speed / steepest)
    far, near = limits.far
    path = Path(limits)
    t = np.arange(1, n + 1) * spacing * limits.dt
    for level in LEVELS:
        path.curve(t, np.sign(far - near) * level * way * x[1:])
    times = max(2, round(16.0 / (2 * T)))
    words = (
        f"Shake it with many frequencies at once, {nice(1 / T, 'Hz')} to {nice(highest, 'Hz')}, in turns "
        f"over {nice(LEVELS[0] * way, limits.unit)} and over {nice(way, limits.unit)}."
    )
    return path.done("multisine", words, 2 * T, times * 2 * T)


def warm_up(limits: Limits, ease: float) -> Motion:
    """Equal slow moves before and after half a minute of fast moves."""
    way = min(0.8 * limits.span, 0.8 * ease * limits.speed)
    a, b = stretch(limits, way)
    slow, fast = 0.25 * ease * limits.speed, 0.9 * ease * limits.speed
    path = Path(limits).rest(0.5).move(a, slow).rest(0.5)
    path.move(b, slow).rest(0.3).move(a, slow).rest(0.3)
    begun = path.time
    while path.time - begun < WORK and len(path.knots) < 1900:
        path.move(b, fast).move(a, fast)
    worked = path.time - begun
    path.rest(0.3).move(b, slow).rest(0.3).move(a, slow)
    words = (
        f"Let it work hard for {nice(worked, 's')}, to and fro over {nice(abs(b - a), limits.unit)}, with one slow "
        "move before and after, so that what drifts as it warms is seen."
    )
    return path.done("warm_up", words)


def small_reversals(limits: Limits, ease: float) -> Motion:
    """Slow triangles with amplitudes of a few to some hundred counts."""
    top = ease * min(400 * limits.resolution, 0.05 * limits.span)
    sizes = np.geomspace(min(6 * limits.resolution, 0.1 * top), top, 5)
    a, _ = stretch(limits, 2 * top)
    far, near = limits.far
    side = np.sign(far - near)
    path = Path(limits).rest(0.5).move(a, 0.3 * limits.speed).rest(0.5)
    for size in sizes:
        half = max(0.5, 2 * size / (0.2 * limits.speed))
        for _ in range(3):
            path.curve(np.array([half, 2 * half]), np.array([side * size, 0.0]))
        path.rest(0.3)
    words = (
        f"Move back and forth within {nice(sizes[0], limits.unit)} and, in five stages, up to "
        f"{nice(top, limits.unit)}, slowly, three times each."
    )
    return path.done("small_reversals", words)


def whole_travel(limits: Limits, ease: float) -> Motion:
    """Move over the whole travel and back at a constant, moderate speed."""
    far, near = limits.far
    v = min(max(0.25 * limits.speed, limits.span / 8.0), 0.9 * limits.speed) * ease
    path = Path(limits).rest(0.5).move(near, v).rest(0.5).move(far, v).rest(0.5).move(near, v).rest(0.5)
    words = (
        f"Move over the whole travel of {nice(limits.span, limits.unit)}, there and back, at an even "
        f"{nice(v, limits.unit + '/s')}."
    )
    return path.done("whole_travel", words)


def dither(limits: Limits, ease: float) -> Motion:
    """Slow move without and with a small fast oscillation."""
    v, half = 0.06 * ease * limits.speed, 4.0
    a, b = stretch(limits, v * half)
    half = abs(b - a) / v if abs(b - a) < v * half else half
    f = min(DITHER / limits.period, FASTEST / limits.dt)
    swing = min(0.15 * ease * limits.speed / (2 * np.pi * f), 0.5 * abs(b - a))
    path = Path(limits).rest(0.5).move(a, 0.3 * limits.speed).rest(0.5)
    path.move(b, v).rest(0.3).move(a, v).rest(0.3)
    periods = max(1, int(2 * half * f))
    t = np.arange(1, 6 * periods + 1) / (6 * f)
    slow = np.interp(t, [0.0, 0.5 * t[-1], t[-1]], [0.0, b - a, 0.0])
    inward = np.sign(b - a) * swing * 0.5 * (1.0 - np.cos(2 * np.pi * f * t)) * (1.0 - slow / ((b - a) or 1.0))
    path.curve(t, slow + inward)
    words = (
        f"Move slowly, {nice(v, limits.unit + '/s')}, there and back, first smoothly and then with a dither of "
        f"{nice(swing, limits.unit)} at {nice(f, 'Hz')} on top."
    )
    return path.done("dither", words)


MENU: tuple[Callable[[Limits, float], Motion], ...] = (
    slow_ramp, constant_speeds, steps_with_rests, multisine, warm_up, small_reversals, whole_travel, dither,
)  # fmt: skip
