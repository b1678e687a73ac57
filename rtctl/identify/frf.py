"""A frequency response as it was measured: complex values with their standard deviation, and what they belong to."""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.identify.records import Record
from rtctl.machines.profile import REELS
from rtctl.machines.profiles import profile_of

CIRCLE_95 = 1.7308  # radius in standard deviations of a complex number that holds 95 % of it: sqrt(-ln 0.05)


CARRIED, MEDIAN = 0.5, 0.35  # relative deviation of a line, and of the middle one of it and its neighbours
NEIGHBOURS = 5  # on either side


class Frf(NamedTuple):
    """Measured position over command, hold and delay included: H_p of (8.1)."""

    f: np.ndarray  # (n,) Hz
    H: np.ndarray  # (n,) complex, rad/V or m/V; per A where the drive is divided out
    sd: np.ndarray  # (n,) standard deviation of H, root of E|dH|^2
    kind: str  # ivu | ldu | axis
    motor: int  # 1 or 2, which one pulls; 1 where there is one
    R1: float  # m, mean radius of reel 1 while it was measured; nan where there is none
    R2: float
    dt: float  # s
    inflation: float  # variance of a smooth function's fit over that of independent lines
    per_ampere: bool  # whether the known drive is divided out

    @property
    def relative(self) -> np.ndarray:
        """Standard deviation over |H|, (n,)."""
        return self.sd / np.abs(self.H)

    def band(self) -> tuple[np.ndarray, np.ndarray]:
        """Magnitude that 95 % of the measurements lie between, (n,) each; 0 where nothing is known from below."""
        away = CIRCLE_95 * self.sd
        return np.maximum(np.abs(self.H) - away, 0.0), np.abs(self.H) + away

    def at(self, f: float) -> complex:
        """H at `f` Hz, interpolated in H (j w)^2, which is level. Raises UserError outside of the lines."""
        if not self.f[0] <= f <= self.f[-1]:
            raise UserError(f"{f:g} Hz lies outside of the response, {self.f[0]:.3g} to {self.f[-1]:.3g} Hz")
        level = self.H * self.f**2
        return complex(np.interp(f, self.f, level.real), np.interp(f, self.f, level.imag)) / f**2

    def select(self, keep: np.ndarray) -> "Frf":
        """The lines where `keep` (n,) holds."""
        return self._replace(f=self.f[keep], H=self.H[keep], sd=self.sd[keep])

    def without_drive(self, config: Any) -> "Frf":
        """H per ampere: the drive of the config divided out (thesis 8.1). Raises UserError where it is already."""
        if self.per_ampere:
            raise UserError("the drive is divided out already")
        D = drive(config, self.f)
        return self._replace(H=self.H / D, sd=self.sd / np.abs(D), per_ampere=True)


def carried(relative: np.ndarray) -> np.ndarray:
    """Lines (n,) that the data carry, from the relative deviations (n,): the line and most of its neighbours do.

    A line alone proves nothing: where there is but noise, one in fifty is twice its own deviation.
    """
    k = min(NEIGHBOURS, (len(relative) - 1) // 2)
    around = np.pad(np.asarray(relative, float), k, mode="reflect") if k else np.asarray(relative, float)
    median = np.median(np.lib.stride_tricks.sliding_window_view(around, 2 * k + 1), axis=1)
    return (relative < CARRIED) & (median < MEDIAN)


def drive(config: Any, f: np.ndarray) -> np.ndarray:
    """Response (n,) of the known drive in A/V at `f` (n,) Hz. Raises UserError where the machine has none."""
    response = profile_of(config.kind).response
    if response is None:
        raise UserError(f"{config.kind}: volts are force there, no drive is known to be divided out")
    return response.drive(config, np.asarray(f, float))


def motor_of(record: Record) -> int:
    """The motor that carries the command. Raises UserError where both do in turn, which is not one response."""
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
    """Mean radii in m of the rows, as the laws take them; nan where there are no reels."""
    if not record.profile.has(REELS):
        return float("nan"), float("nan")
    return float(record["R1"][rows].mean()), float(record["R2"][rows].mean())
