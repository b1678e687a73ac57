"""Colour of a printed grey image over position, and colour difference dE to the mean: CIE 1976 L*a*b*.

Four inks are printed by heads at different places along the travel of the carriage: each ink meets the position error
at another position. Where its lines lie closer, an ink covers more of the paper:

    a_i = a_0 pitch / (pitch + e(x + p_i + lead) - e(x + p_i))
    X = X_n T_n (1 - a_c (1 - t_c,X)) ... (1 - a_k (1 - t_k,X)),   Y and Z alike
    L* = 116 f(Y / Y_n) - 16,  a* = 500 (f(X / X_n) - f(Y / Y_n)),  b* = 200 (f(Y / Y_n) - f(Z / Z_n))
    dE = sqrt((L* - L_0)^2 + (a* - a_0)^2 + (b* - b_0)^2)

p_i is the position of the nozzles of ink i, t_i the transmission of X, Y and Z of its solid layer, T_n the reflectance
of the paper. f is the cube root, and a straight line below (6/29)^3.

Source: CIE 15 (1976), 8.2.1 for L*a*b* and dE; Demichel 1924 and Neugebauer 1937 for inks with random overlap,
a product for layers without scattering; thesis 11.2. Inks, places of nozzles and coverage are chosen.
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.config.errors import NoAnswer
from rtctl.identify.wavelength import Spectrum, spectrum
from rtctl.idiom import Settings, quantity

INKS: dict[str, tuple[float, float, float]] = {  # share of X, Y and Z that a solid layer lets through
    "cyan": (0.17, 0.24, 0.70), "magenta": (0.35, 0.18, 0.22),
    "yellow": (0.80, 0.86, 0.09), "black": (0.04, 0.04, 0.04),
}  # fmt: skip
LINEAR = (6.0 / 29.0) ** 3  # of f, below which it is a line


class ColorSettings(Settings):
    """The image: one coverage for all inks makes it grey."""

    pitch: float = quantity(1e-3 / 12, unit="m", gt=0, help="between lines: 1/12 or 1/24 mm")
    lead: float = quantity(2e-3, unit="m", gt=0, help="between the nozzles of neighbouring lines of one ink")
    apart: float = quantity(12e-3, unit="m", gt=0, help="between the heads of two inks along the carriage's way")
    coverage: float = Field(default=0.25, gt=0, lt=1, description="a_0, share of the paper that each ink covers")
    paper: float = Field(default=0.85, gt=0, le=1, description="share of the light that the paper gives back")
    aperture: float = quantity(1e-3, unit="m", gt=0, help="of the instrument, along the position")


class Colors(NamedTuple):
    """Colour over the position, without drift and noise of a print."""

    x: np.ndarray  # (n,) m
    Lab: np.ndarray  # (n, 3)
    dE: np.ndarray  # (n,) from the mean colour

    @property
    def rms(self) -> float:
        """Root of the mean square of dE."""
        return float(np.sqrt(np.mean(self.dE**2)))

    @property
    def most(self) -> float:
        """dE that 95 % of the image stay below."""
        return float(np.quantile(self.dE, 0.95))


def f(t: np.ndarray) -> np.ndarray:
    """Cube root of CIE 1976, a line near zero."""
    t = np.asarray(t, float)
    return np.where(t > LINEAR, np.cbrt(t), t / (3.0 * (6.0 / 29.0) ** 2) + 4.0 / 29.0)


def lab(XYZ: np.ndarray) -> np.ndarray:
    """L*a*b* (n, 3) of XYZ (n, 3) as shares of the white point."""
    x, y, z = f(XYZ).T
    return np.column_stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """dE of CIE 1976 (n,) between L*a*b* (n, 3) and (n, 3) or (3,)."""
    return np.asarray(np.linalg.norm(np.asarray(one) - np.asarray(other), axis=-1))


def printed(x: np.ndarray, e: np.ndarray, settings: ColorSettings | None = None) -> Colors:
    """Colours of a grey image printed with the error `e` (n,) m at rising positions `x` (n,) m.

    Raises NoAnswer where the record is shorter than the heads are apart, or lines overtake one another.
    """
    s = settings or ColorSettings()
    reach = s.lead + (len(INKS) - 1) * s.apart
    at = np.arange(x[0], x[-1] - reach, s.pitch)
    if len(at) < 100:
        raise NoAnswer(
            f"{1e3 * float(np.ptp(x)):.1f} mm of record give {len(at)} lines of every ink; an image takes 100"
        )
    XYZ = np.full((len(at), 3), s.paper)
    for number, through in enumerate(INKS.values()):
        place = at + number * s.apart
        gap = s.pitch + np.interp(place + s.lead, x, e) - np.interp(place, x, e)
        if gap.min() <= 0.2 * s.pitch:
            raise NoAnswer(f"lines overtake one another at {1e3 * place[np.argmin(gap)]:.1f} mm: the error has jumps")
        cover = np.minimum(s.coverage * s.pitch / gap, 1.0)
        XYZ *= 1.0 - cover[:, None] * (1.0 - np.array(through))
    width = max(round(s.aperture / s.pitch), 1)
    if width > 1:
        padded = np.pad(XYZ, ((width, width), (0, 0)), mode="edge")
        XYZ = np.column_stack([np.convolve(c, np.ones(width) / width, mode="same")[width:-width] for c in padded.T])
    found = lab(XYZ)
    return Colors(at, found, difference(found, found.mean(axis=0)))


def coherence(
    errors: list[np.ndarray], images: list[np.ndarray], x: np.ndarray, N: int
) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths (k,) in m, and coherence (k,) of the position error with a colour, over several prints.

    |sum E* Gamma|^2 / (sum |E|^2 sum |Gamma|^2) over prints of the same way, each (n,) at `x` (n,) m; 1 where the same
    error gives the same colour every time, about 1 / prints where one has nothing to do with the other. Raises
    NoAnswer with fewer than four prints.
    """
    if len(errors) < 4 or len(errors) != len(images):
        raise NoAnswer(f"{len(errors)} errors and {len(images)} images; a coherence takes at least four of each")
    both: list[list[Spectrum]] = [[spectrum(x, y, N, float(np.ptp(x))) for y in group] for group in (errors, images)]
    E, G = (np.array([one.E for one in group]) for group in both)
    k = min(E.shape[1], G.shape[1])
    cross = np.abs((np.conj(E[:, :k]) * G[:, :k]).sum(axis=0)) ** 2
    power = (np.abs(E[:, :k]) ** 2).sum(axis=0) * (np.abs(G[:, :k]) ** 2).sum(axis=0)
    return both[0][0].wavelength[:k], cross / power
