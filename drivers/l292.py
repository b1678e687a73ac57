"""L292 switch-mode driver: a full bridge that chops at 22 kHz, inside a current loop.

    I_M/V_I = K (1 + s R_F C_F) / (1 + 2 zeta s/w_0 + s^2/w_0^2),   K = R_2 R_4 / (R_1 R_3 R_S)
    w_0 = sqrt(G_mo R_S / (R_F C_F R_4 C)),  zeta = sqrt(R_4 C / (4 R_F C_F G_mo R_S)),  G_mo = 2 V_S / (V_R R_M)

once R C = L_M / R_M cancels the pole of the motor (7.3). Volts in, amperes out, ten volts for two amperes.

Component values: R_M = 58 ohm is the 24 V motor of appendix E and V_R = 8 V the data sheet's. With them the printed
C = 1.24e-4 R_F C_F means R_4 = 400 ohm, and R C R_M gives L_M = 65 mH. Of the internal resistors only R_4 and the
ratio matter. The ratio is 0.048 (0.24 ohm, 0.2 A/V); the data sheet's 0.12 A/V at
0.4 ohm says the same, its 0.22 A/V at 0.2 ohm says 0.044.

Source: thesis 7.2, (7.1)-(7.3), appendices C, E; SGS-Thomson, L292 data sheet.
Erratum: the printed f_0 lacks 1/2 pi, it is w_0 in rad/s. With the printed values it is 2.1 kHz; 3 kHz is the filter's
1/(2 pi R_F C_F). The zero lifts the -3 dB point to 0.9/(2 pi R_F C_F) = 2.7 kHz, and that is `cutoff`.
Erratum: 24 V drive no more than 0.41 A through 58 ohm, so the 2 A of (7.2) are never reached; see `supply_limit`.
"""

import math
from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick

TOLERANCE = 0.1  # largest relative difference of R C and L_M / R_M; beyond it the driver has more than two states


class L292Settings(Settings):
    R_S: float = quantity(0.24, unit="ohm", gt=0, le=10, help="sensing resistor")
    ratio: float = quantity(0.048, unit="", gt=0, le=1, help="R_2 R_4 / (R_1 R_3), inside the L292")
    R_4: float = quantity(400.0, unit="ohm", gt=0, help="resistor of the current sensing amplifier, inside the L292")
    R_F: float = quantity(510.0, unit="ohm", gt=0, help="resistor of the current filter")
    C_F: float = quantity(104e-9, unit="F", gt=0, help="capacitor of the current filter")
    R: float = quantity(170e3, unit="ohm", ge=5.6e3, help="resistor of the error amplifier, at least 5.6 kohm")
    C: float = quantity(6.6e-9, unit="F", gt=0, help="capacitor of the error amplifier")
    R_O: float = quantity(15e3, unit="ohm", ge=8.2e3, help="resistor of the oscillator, at least 8.2 kohm")
    C_O: float = quantity(1.5e-9, unit="F", gt=0, help="capacitor of the oscillator")
    V_S: float = quantity(24.0, unit="V", ge=18, le=36, help="supply")
    V_R: float = quantity(8.0, unit="V", gt=0, help="reference inside the L292")
    R_M: float = quantity(58.0, unit="ohm", gt=0, help="resistance of the motor")
    L_M: float = quantity(65e-3, unit="H", gt=0, help="inductance of the motor")
    I_max: float = quantity(2.0, unit="A", gt=0, le=2.5, help="highest current of the bridge")
    supply_limit: bool = Field(False, description="limit also to what the supply drives through R_M at standstill")
    ripple: bool = Field(False, description="add the current ripple of the chopping")


class L292Params(NamedTuple):
    volts_max: float  # command at the highest current
    ripple: float  # A, amplitude; 0 where it is off
    f_osc: float  # Hz


RIPPLE_STATE = state(cycle=float)  # phase in the chopping period, 0 to 1


def gain(settings: L292Settings) -> float:
    """DC gain in A/V (7.2)."""
    return settings.ratio / settings.R_S


def second_order(settings: L292Settings) -> tuple[float, float, float]:
    """DC gain in A/V, natural frequency in rad/s and damping, after the cancellation (7.3).

    Raises ValueError where R C does not cancel the pole of the motor.
    """
    p = settings
    rc, lr = p.R * p.C, p.L_M / p.R_M
    if abs(rc / lr - 1.0) > TOLERANCE:
        raise ValueError(f"R C = {rc:.3g} s does not cancel the motor's L_M/R_M = {lr:.3g} s (7.3); "
                         f"choose R = {lr / p.C:.3g} ohm")  # fmt: skip
    loop = 2 * p.V_S / (p.V_R * p.R_M) * p.R_S
    w_0 = math.sqrt(loop / (p.R_F * p.C_F * p.R_4 * p.C))
    zeta = math.sqrt(p.R_4 * p.C / (4 * p.R_F * p.C_F * loop))
    return gain(p), w_0, zeta


def state_space(settings: L292Settings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (2, 2), B (2,), C (2,) from command in V to current in A, both states in A. Raises as `second_order`.

    x_1 is the current without the zero; x_2 = x_1' / w_0.
    """
    K, w, zeta = second_order(settings)
    zero = settings.R_F * settings.C_F
    return np.array([[0.0, w], [-w, -2 * zeta * w]]), np.array([0.0, w * K]), np.array([1.0, zero * w])


def cutoff(settings: L292Settings) -> float:
    """Frequency in Hz where the gain has fallen by 3 dB, in closed form."""
    _, w, zeta = second_order(settings)
    a = (settings.R_F * settings.C_F * w) ** 2
    b = 1.0 - 2.0 * zeta * zeta + a  # (x^2)^2 - 2 b x^2 - 1 = 0 with x = w/w_0
    return w * math.sqrt(b + math.sqrt(b * b + 1.0)) / (2 * math.pi)


def transfer_function(settings: L292Settings, f: np.ndarray) -> np.ndarray:
    """I_M/V_I in A/V at `f` Hz, complex, as (7.1): before the cancellation."""
    p = settings
    s = 2j * np.pi * np.asarray(f, float)
    G_mo = 2 * p.V_S / (p.V_R * p.R_M)
    pole = (1 + s * p.R * p.C) / (1 + s * p.L_M / p.R_M)
    below = pole * G_mo * p.R_S + s * p.R_4 * p.C + s**2 * p.R_F * p.R_4 * p.C_F * p.C
    return p.ratio * G_mo * pole * (1 + s * p.R_F * p.C_F) / below


def f_osc(settings: L292Settings) -> float:
    """Chopping frequency in Hz."""
    return 1.0 / (2.0 * settings.R_O * settings.C_O)


def ripple(settings: L292Settings) -> float:
    """Amplitude in A of the triangular ripple at a duty of one half, where it is largest: V_S / (4 L_M f_osc)."""
    return settings.V_S / (4.0 * settings.L_M * f_osc(settings))


def build(settings: L292Settings, dt: float) -> L292Params:
    """Parameters, independent of `dt`; the linear part is in the plant's matrices. Raises as `second_order`."""
    K, _, _ = second_order(settings)
    I_max = min(settings.I_max, settings.V_S / settings.R_M) if settings.supply_limit else settings.I_max
    return L292Params(I_max / K, ripple(settings) if settings.ripple else 0.0, f_osc(settings))


@tick
def limit(p, volts):
    """Command in V, clipped to the command of the highest current. NaN gives 0 V."""
    if math.isnan(volts):
        return 0.0
    return min(max(volts, -p.volts_max), p.volts_max)


@tick
def ripple_step(p, s, h):
    """Mean of the triangular ripple current (A) over the next `h` s, to be added to the current."""
    periods = p.f_osc * h
    end = s.cycle + periods
    end -= math.floor(end)
    mean = p.ripple * (_triangle_area(end) - _triangle_area(s.cycle)) / periods
    s.cycle = end
    return mean


@tick
def _triangle_area(c):
    """Integral from 0 to `c` in [0, 1) of a triangle that is -1 at 0 and +1 at one half."""
    return c * (2.0 * c - 1.0) if c < 0.5 else (1.0 - c) * (2.0 * c - 1.0)
