"""Mechanics of the linear drive: radii of the largest acceleration, and torque that friction wheels can carry.

    x'' / I = K_m N R_c / (J_m N^2 + J_t + J_c + J_e + M R_c^2)      N = R_t / R_s

A wheel's inertia and a shaft's stiffness grow with the fourth power of the radius (F.12-F.14). A larger capstan has
more travel per turn and more inertia; a smaller wheel has less inertia and a lower ratio.

Source: thesis 12.4, 12.5, 13, appendix F; 11.1 for the errors. The optimum is flat: 4.4 dB at the thesis's 6.2 and
23 mm, 4.5 dB at 5.7 and 19.2 mm.
"""

from typing import NamedTuple

import numpy as np

from rtctl.plants import ldu
from rtctl.plants.ldu import LduParameters, LduSettings

STEEL_ON_STEEL = 0.8  # friction coefficient, dry (12.5)
MOTOR_FORCE, STRIP_FORCE = 12.0, 20.0  # N, motor on wheel and capstan on strip (12.5)
MOTOR_TORQUE = 15e-3  # Nm, largest of the motor; chosen so that 12.5 gives its 125 N, the text names none
SHEAR, DENSITY = 70e9, 7.85e3  # N/m^2 and kg/m^3, steel as appendix F has it


class Optimum(NamedTuple):
    R_c: float  # m
    R_t: float  # m
    gain: float  # dB above the present radii


class Modes(NamedTuple):
    """Undamped frequencies in Hz, rising."""

    resonances: np.ndarray
    anti_resonances: np.ndarray


def named(name: str = "appendix_f") -> LduParameters:
    """Parameters of a named set, `appendix_f` or `figure_12_2`."""
    return ldu.parameters(LduSettings.model_validate({"set": name}))


def acceleration(p: LduParameters) -> float:
    """Acceleration of the carriage in m/s^2 per A of motor current, at low frequencies."""
    N = p.R_t / p.R_s
    return p.K_m1 * N * p.R_c / (p.J_m * N**2 + p.J_t + p.J_c + p.J_e + p.M * p.R_c**2)


def with_radii(p: LduParameters, R_c: float, R_t: float) -> LduParameters:
    """The same drive with another capstan and wheel (m) of the same steel and width."""
    capstan, wheel = (R_c / p.R_c) ** 4, (R_t / p.R_t) ** 4
    change = {"R_c": R_c, "R_t": R_t, "J_c": p.J_c * capstan, "k_c": p.k_c * capstan, "J_t": p.J_t * wheel}
    return p.model_copy(update=change)


def gain(p: LduParameters, R_c: float, R_t: float) -> float:
    """Gain in dB of acceleration by other radii (m)."""
    return float(20 * np.log10(acceleration(with_radii(p, R_c, R_t)) / acceleration(p)))


def optimum(p: LduParameters) -> Optimum:
    """Radii of capstan and wheel with the largest acceleration per ampere."""
    from scipy.optimize import minimize  # slow to import, and needed here only

    start = np.log([p.R_c, p.R_t])
    found = minimize(lambda x: -gain(p, *np.exp(x)), start, method="Nelder-Mead", options={"xatol": 1e-6})
    R_c, R_t = (float(v) for v in np.exp(found.x))
    return Optimum(R_c, R_t, gain(p, R_c, R_t))


def modes(p: LduParameters, of: str = "carriage") -> Modes:
    """Resonances and anti-resonances without damping, from current to `carriage` or `encoder` (figure 12.2)."""
    from scipy.linalg import eigvals  # slow to import, and needed here only

    free = p.model_copy(update={"b_s": 0.0, "b_c": 0.0, "B_c": 0.0, "B_m": 0.0, "K_m2": 0.0})
    A, _ = ldu.state_space(ldu.build(LduSettings(parameters=free), 1e-4, (1.0, 1.0)))
    nq = ldu.NQ
    stiff = -A[nq : 2 * nq, :nq]  # inverse mass times stiffness
    node = ldu.ENCODER if of == "encoder" else ldu.CAPSTAN
    minor = np.delete(np.delete(stiff, ldu.MOTOR, axis=0), node, axis=1)  # zeros: w^2 where this minor is singular
    eye = np.delete(np.delete(np.eye(nq), ldu.MOTOR, axis=0), node, axis=1)
    return Modes(_hertz(np.linalg.eigvals(stiff)), _hertz(eigvals(minor, eye)))


def slip_torque(F_N: float, radius: float, N: float = 1.0, f: float = STEEL_ON_STEEL) -> float:
    """Largest motor torque in Nm that a friction wheel carries: pressed by `F_N` N, `radius` m, `N` turns away."""
    return f * F_N * radius / N


def normal_force(tau: float, N: float, R_c: float, f: float = STEEL_ON_STEEL) -> float:
    """Force in N with which the capstan must be pressed for it not to slip at a motor torque of `tau` Nm (12.5)."""
    return tau * N / (R_c * f)


def torsion_stiffness(R: float, length: float, G: float = SHEAR) -> float:
    """Stiffness of a round bar in Nm/rad (F.12)."""
    return np.pi * G * R**4 / (2 * length)


def disc_inertia(R: float, length: float, rho: float = DENSITY) -> float:
    """Inertia of a round bar or wheel in kg m^2 (F.13, F.14)."""
    return 0.5 * np.pi * R**4 * length * rho


def wavelength(R_c: float) -> float:
    """Travel of one turn of the capstan in m (11.4)."""
    return 2 * np.pi * R_c


def disc_error(eccentricity: float, R_g: float) -> float:
    """Largest reading error in rad of a disc off centre on its graduation radius, both m (11.5)."""
    return float(np.arctan(eccentricity / R_g))


def strip_error(amplitude: float, wave: float, travel: float, samples: int = 20_000) -> float:
    """Path along a strip that waves with `amplitude` and length `wave`, less the travel, m (11.6)."""
    x = (np.arange(samples) + 0.5) / samples * travel
    slope = 2 * np.pi * amplitude / wave * np.cos(2 * np.pi * x / wave)
    return float(np.mean(np.hypot(1.0, slope) - 1.0) * travel)


def _hertz(squares: np.ndarray) -> np.ndarray:
    """Frequencies of those w^2 that are finite, positive and no rigid body's."""
    real = np.real(squares[np.isfinite(squares)])
    return np.sort(np.sqrt(real[real > 1.0])) / (2 * np.pi)
