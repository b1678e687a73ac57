"""Best linear approximation by a periodic odd random-phase multisine: response, noise and distortion levels.

    G_m = mean of Y/W over periods / mean of U/W over periods                  one realisation of the phases
    G   = mean of Y/W / mean of U/W over realisations                          best linear approximation
    noise  from period to period      total  from realisation to realisation
    odd    = sqrt(total^2 - noise^2)  even = lines without excitation, less the feedback of the loop

A period holds a whole number of cycles of every line: there is no leakage and no window. The excitation W is known
exactly. Input and output are projected on W, so noise in the feedback causes no bias. Distortions of odd order fall on
the excited lines and change with the phases. Distortions of even order fall between the excited lines.

Source: Pintelon & Schoukens, System Identification (2012), chapters 2 (periodic, in feedback) and 4 (odd multisines).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify.frf import Frf, carried, motor_of, radii
from rtctl.identify.records import Record, check, steady, take_all
from rtctl.machines.profile import REELS

SMOOTH = 4  # neighbours on either side in the average of a variance; few realisations estimate it poorly


class BestLinear(NamedTuple):
    f: np.ndarray  # (n,) Hz, excited lines with sufficient accuracy
    G: np.ndarray  # (n,) complex, rad/V or m/V, hold and delay included
    noise: np.ndarray  # (n,) standard deviation of G by noise, root of E|dG|^2
    total: np.ndarray  # (n,) standard deviation of G, mean over realisations, by noise and distortion
    odd: np.ndarray  # (n,) level of odd distortion in one realisation, rad/V or m/V
    f_even: np.ndarray  # (m,) Hz, lines without excitation
    even: np.ndarray  # (m,) level of even distortion, rad/V or m/V, per input of the neighbouring lines
    realisations: int
    periods: int  # in each realisation
    frf: Frf


class _Realisation(NamedTuple):
    """Spectra of one realisation, period by period, at the excited lines in the phase of the excitation."""

    f: np.ndarray  # (n,) Hz
    excited: np.ndarray  # (n,) bool
    Y: np.ndarray  # (p, n)
    U: np.ndarray  # (p, n)
    leg: np.ndarray  # (p,) number of the leg of each period
    radii: tuple[float, float]

    def scatter(self, V: np.ndarray) -> np.ndarray:
        """Variance (n,) of the mean of V (p, n) over the periods, from the scatter within each leg."""
        legs = np.unique(self.leg)
        off = V - np.stack([V[self.leg == i].mean(0) for i in legs])[np.searchsorted(legs, self.leg)]
        return (np.abs(off) ** 2).sum(0) / (len(V) - len(legs)) / len(V)


def identify(sources: Sequence[Any] | Any, band: tuple[float, float] | None = None) -> BestLinear:
    """Best linear approximation from one record for each realisation, all with the same period, band and rms.

    Each record holds one or more legs at constant speed of at least three periods; the first period is discarded for
    the transient. Raises NoAnswer: too short, fewer than two realisations, drive saturated, trip, unstable loop,
    band too inaccurate; UserError for records of different machines or settings.
    """
    records = take_all(sources)
    n, motor = _together(records)
    parts = [_realisation(record, n, motor) for record in records]
    if len(parts) < 2:
        raise NoAnswer(
            f"{records[0].source}: one realisation does not separate distortion from the response; record at least two "
            "with another excitation.seed each"
        )
    f, on = parts[0].f, parts[0].excited
    y, u = (np.array([x[:, on].mean(0) for x in spectra]) for spectra in ([p.Y for p in parts], [p.U for p in parts]))
    G = y.mean(0) / u.mean(0)
    count = len(parts)
    away = (y - G * u) / u.mean(0)  # G_m - G to first order, which has no bias of a ratio
    size2 = np.abs(G) ** 2  # relative variances vary slowly, so neighbours can be averaged
    total2 = size2 * _smooth((np.abs(away) ** 2).sum(0) / (count - 1) / count / size2)
    noise2 = size2 * _smooth(_noise(parts, G, u.mean(0)) / size2)
    total2 = np.maximum(total2, noise2)
    odd = np.sqrt(np.maximum(total2 - noise2, 0.0) * count)
    f_even, even = _even(parts, G, u.mean(0))
    R = np.mean([p.radii for p in parts], axis=0)
    frf = Frf(f[on], G, np.sqrt(total2), records[0].kind, motor, float(R[0]), float(R[1]), records[0].dt, 1.0, False)
    keep = _carried(records[0], frf, band)
    return BestLinear(
        f[on][keep], G[keep], np.sqrt(noise2[keep]), np.sqrt(total2[keep]), odd[keep], f_even, even, count,
        min(len(p.Y) for p in parts), frf.select(keep),
    )  # fmt: skip


def _together(records: list[Record]) -> tuple[int, int]:
    """Samples in a period, and the driving motor. Raises UserError for records of different machines or settings."""
    first = records[0]
    for record in records:
        e = record.config.excitation
        if e.kind != "multisine":
            raise UserError(f"{record.source}: excitation.kind is {e.kind}; this reads records with a multisine")
        same = e.model_copy(update={"seed": first.config.excitation.seed})
        if record.kind != first.kind or record.dt != first.dt or same != first.config.excitation:
            raise UserError(f"{record.source}: machine, rate and excitation but for its seed must be those of "
                            f"{first.source}")  # fmt: skip
    seeds = [record.config.excitation.seed for record in records]
    if len(set(seeds)) < len(seeds):
        raise UserError(f"{first.source}: the seeds {', '.join(map(str, seeds))} repeat; each record needs its own")
    motors = {motor_of(record) for record in records}
    if len(motors) > 1:
        raise UserError(f"{first.source}: some records pull with motor 1 and some with motor 2; identify them apart")
    return round(first.config.excitation.period / first.dt), motors.pop()


def _realisation(record: Record, n: int, motor: int) -> _Realisation:
    legs = []
    for s in steady(record, 0.0):
        periods = (s.stop - s.start) // n - 1  # without the first period, for the transient
        if periods >= 2:
            legs.append(slice(s.stop - periods * n, s.stop))
    check(record, legs)
    if not legs:
        longest = max((s.stop - s.start for s in steady(record, 0.0)), default=0) * record.dt
        raise NoAnswer(
            f"{record.source}: too short, the longest stretch at constant speed takes {longest:.2f} s; three periods "
            f"of {n * record.dt:.4g} s are the least"
        )
    e = record.config.excitation
    f = np.fft.rfftfreq(n, record.dt)
    lines = np.arange(len(f))
    top = (lines > 0) & (f >= e.f_min - 1e-9) & (f <= e.f_max + 1e-9)
    f, lines = f[top], lines[top]
    excited = lines % 2 == 1
    y, u = -record.error, _input(record, motor)
    Y, U, W = (
        np.concatenate([_periods(x[leg], (leg.stop - leg.start) // n)[:, top] for leg in legs])
        for x in (y, u, record["w"])
    )
    if not np.abs(W[:, excited]).min() > 0:
        raise NoAnswer(f"{record.source}: column 'w' does not hold the excitation of the config")
    back = np.where(excited, np.exp(-1j * np.angle(W)), 1.0)
    number = np.repeat(np.arange(len(legs)), [(leg.stop - leg.start) // n for leg in legs])
    rows = np.concatenate([np.arange(leg.start, leg.stop) for leg in legs])
    return _Realisation(f, excited, Y * back, U * back, number, radii(record, rows))


def _input(record: Record, motor: int) -> np.ndarray:
    """Voltage (n,) written to the drive, V, with the sign of the command; includes rounding and limits."""
    if not record.profile.has(REELS):
        return record["u"]
    return record["u1"] if motor == 1 else -record["u2"]


def _periods(x: np.ndarray, k: int) -> np.ndarray:
    """Spectra (k, n/2 + 1) of `k` periods, without the linear drift."""
    n = len(x) // k
    drift = np.mean(x[n:] - x[:-n]) / n  # a fitted line would also remove part of the periodic signal
    return np.fft.rfft((x - drift * np.arange(len(x))).reshape(k, n), axis=1) / n


def _noise(parts: list[_Realisation], G: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Variance of G by noise, from the scatter of Y - G U over the periods."""
    variance = [p.scatter(p.Y[:, p.excited] - G * p.U[:, p.excited]) for p in parts]
    return np.sum(variance, axis=0) / len(parts) ** 2 / np.abs(u) ** 2


def _even(parts: list[_Realisation], G: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and even distortion: level of lines without excitation, less noise and feedback, over the input."""
    on, f = parts[0].excited, parts[0].f
    off = ~on
    level = G * f[on] ** 2  # G f^2 varies slowly enough for interpolation
    G_off = (np.interp(f[off], f[on], level.real) + 1j * np.interp(f[off], f[on], level.imag)) / f[off] ** 2
    powers = []
    for p in parts:
        for i in np.unique(p.leg):
            V = p.Y[p.leg == i][:, off] - G_off * p.U[p.leg == i][:, off]
            noise = np.var(V, axis=0, ddof=1) / len(V)
            powers.append(np.abs(V.mean(0)) ** 2 - noise)
    size2 = np.abs(G_off) ** 2
    power = size2 * _smooth(np.mean(powers, axis=0) / size2)
    return f[off], np.sqrt(np.maximum(power, 0.0)) / np.interp(f[off], f[on], np.abs(u))


def _smooth(x: np.ndarray) -> np.ndarray:
    """Moving mean over SMOOTH neighbours on either side, fewer at the ends."""
    k = min(SMOOTH, (len(x) - 1) // 2)
    total = np.cumsum(np.concatenate(([0.0], x)))
    low = np.maximum(np.arange(len(x)) - k, 0)
    high = np.minimum(np.arange(len(x)) + k + 1, len(x))
    return (total[high] - total[low]) / (high - low)


def _carried(record: Record, frf: Frf, band: tuple[float, float] | None) -> np.ndarray:
    good = carried(frf.relative)
    inside = np.ones(len(good), bool) if band is None else (frf.f >= band[0] - 1e-9) & (frf.f <= band[1] + 1e-9)
    if not inside.any():
        raise NoAnswer(f"{record.source}: nothing was excited from {band[0]:g} to {band[1]:g} Hz")  # type: ignore[index]
    bad = np.flatnonzero(inside & ~good)
    if (band is not None and len(bad) > 0.05 * inside.sum()) or (good & inside).sum() < 5:
        raise NoAnswer(
            f"{record.source}: the deviation of the response is above 50 % from {frf.f[bad[0]]:.3g} to "
            f"{frf.f[bad[-1]]:.3g} Hz; take more excitation, more periods or more realisations"
        )
    return inside & good
