"""Measured frequency response: complex values, standard deviations and conditions of the measurement."""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.identify.records import Record
from rtctl.machines.profile import REELS
from rtctl.machines.profiles import profile_of

CIRCLE_95 = 1.7308  # radius of the 95 % circle of a complex number in standard deviations: sqrt(-ln 0.05)


CARRIED, MEDIAN = 0.5, 0.35  # greatest relative deviation of a line, and of the median over its neighbours
NEIGHBOURS = 5  # neighbours on either side


class Frf(NamedTuple):
    """Measured position over command, hold and delay included: H_p of (8.1)."""

    f: np.ndarray  # (n,) Hz
    H: np.ndarray  # (n,) complex, rad/V or m/V; per A where the drive is divided out
    sd: np.ndarray  # (n,) standard deviation of H, root of E|dH|^2
    kind: str  # ivu | ldu | axis
    motor: int  # driving motor, 1 or 2; 1 for a machine with one motor
    R1: float  # m, mean radius of reel 1 during the measurement; nan without reels
    R2: float
    dt: float  # s
    inflation: float  # variance of the fit of a smooth function over its variance with independent lines
    per_ampere: bool  # whether the known drive is divided out

    @property
    def relative(self) -> np.ndarray:
        """Relative standard deviation (n,), sd / |H|."""
        return self.sd / np.abs(self.H)

    def band(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper 95 % limits of the magnitude, (n,) each; lower limit 0 where the circle includes 0."""
        away = CIRCLE_95 * self.sd
        return np.maximum(np.abs(self.H) - away, 0.0), np.abs(self.H) + away

    def at(self, f: float) -> complex:
        """H at `f` Hz, interpolated in H (j w)^2, which varies slowly. Raises UserError outside of the lines."""
        if not self.f[0] <= f <= self.f[-1]:
            raise UserError(f"{f:g} Hz lies outside of the response, {self.f[0]:.3g} to {self.f[-1]:.3g} Hz")
        level = self.H * self.f**2
        return complex(np.interp(f, self.f, level.real), np.interp(f, self.f, level.imag)) / f**2

    def select(self, keep: np.ndarray) -> "Frf":
        """Response at the lines where `keep` (n,) is True."""
        return self._replace(f=self.f[keep], H=self.H[keep], sd=self.sd[keep])

    def without_drive(self, config: Any) -> "Frf":
        """H per ampere: the drive of the config divided out (thesis 8.1). Raises UserError the second time."""
        if self.per_ampere:
            raise UserError("the drive is divided out already")
        D = drive(config, self.f)
        return self._replace(H=self.H / D, sd=self.sd / np.abs(D), per_ampere=True)


def carried(relative: np.ndarray) -> np.ndarray:
    """Mask (n,) of sufficiently accurate lines, from relative deviations (n,) of each line and its neighbours.

    One line is no evidence: in pure noise, one line in fifty is twice its own deviation.
    """
    k = min(NEIGHBOURS, (len(relative) - 1) // 2)
    around = np.pad(np.asarray(relative, float), k, mode="reflect") if k else np.asarray(relative, float)
    median = np.median(np.lib.stride_tricks.sliding_window_view(around, 2 * k + 1), axis=1)
    return (relative < CARRIED) & (median < MEDIAN)


def drive(config: Any, f: np.ndarray) -> np.ndarray:
    """Response (n,) of the known drive in A/V at `f` (n,) in Hz. Raises UserError where no drive is known."""
    response = profile_of(config.kind).response
    if response is None:
        raise UserError(f"{config.kind}: volts are force there, no drive is known to be divided out")
    return response.drive(config, np.asarray(f, float))


def motor_of(record: Record) -> int:
    """Motor that takes the whole command. Raises UserError where both motors do: that is not one response."""
    if not record.profile.has(REELS):
        return 1
    kind = record.config.law.allocation.kind
    if kind in ("motor1", "motor2"):
        return int(kind[-1])
    u_c = record["u_c"]
    if kind == "pull" and (np.all(u_c > 0) or np.all(u_c < 0)):
        return 1 if u_c[0] > 0 else 2
    raise UserError(
        f"{record.source}: law.allocation.kind is {kind}, and two motors pull by turns or together; that is not one "
        "response. Record with motor1 or motor2, as `rtctl identify multisine CONFIG` does"
    )


def radii(record: Record, rows: Any) -> tuple[float, float]:
    """Mean radii in m over the rows, as used by the laws; nan without reels."""
    if not record.profile.has(REELS):
        return float("nan"), float("nan")
    return float(record["R1"][rows].mean()), float(record["R2"][rows].mean())
