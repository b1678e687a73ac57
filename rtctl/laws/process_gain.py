"""Process gain K_p of the two-reel unit: capstan acceleration per volt on one motor, from the reel radii.

At the tape, the reels (with their motors) and the capstan are three masses coupled by two tape springs:

    J_i = J_m + J_0 + pi/2 rho h (R_i^4 - R_min^4)      m_i = J_i / R_i^2      m_c = J_c / R_c^2
    kappa = c + j w k                                   M = m_c + sum of m_i kappa / (kappa - w^2 m_i)
    K_p = K_m amp_per_volt / (R_drive R_c) | kappa / (kappa - w^2 m_drive) / M |

At w = 0 this is the rigid sum K_m amp_per_volt / (R_drive R_c (m_1 + m_2 + m_c)). With the identified set at
R1 = 38, R2 = 22 mm the rigid sum is 29.7 and the gain at 1 Hz is 25.6 rad/s^2 per A: the second reel, which decouples
at 1.9 Hz, already takes part of the motion. The coupling between motor and reel (40 Hz) is taken as stiff.

Source: thesis 4.1-4.2, 4.9-4.17 and appendix A (identified); K_p = 25.4 in section 8.2.
Erratum: section 8.2 leaves out the motor driver; by the equations 25.4 is per ampere, 5.1 per volt at 0.2 A/V.
"""

from math import pi
from typing import NamedTuple

from rtctl.idiom import quantity, tick
from rtctl.laws.drive import DriveSettings


class ProcessGainSettings(DriveSettings):
    frequency: float = quantity(1.0, unit="Hz", ge=0, help="where the gain is taken; 0 for the rigid sum")
    J_m: float = quantity(1.5e-3, unit="kg*m^2", gt=0, help="inertia of a motor at its reel")
    J_0: float = quantity(1e-6, unit="kg*m^2", ge=0, help="inertia of an empty reel")
    J_c: float = quantity(5e-6, unit="kg*m^2", gt=0, help="inertia of the capstan")
    rho: float = quantity(1.7e3, unit="kg/m^3", gt=0, help="density of the paper")
    h: float = quantity(3.7e-2, unit="m", gt=0, help="height of the tape")
    R_c: float = quantity(1.25e-2, unit="m", gt=0, help="radius of the capstan")
    R_min: float = quantity(2e-2, unit="m", gt=0, help="smallest radius of a reel")
    R_max: float = quantity(4e-2, unit="m", gt=0, help="largest radius of a reel")
    c: float = quantity(450.0, unit="N/m", gt=0, help="stiffness of the tape on either side of the capstan")
    k: float = quantity(12.5, unit="N*s/m", ge=0, help="damping of the tape on either side of the capstan")


class ProcessGainParams(NamedTuple):
    torque_per_volt: float  # Nm/V
    w: float  # rad/s
    J_reel: float  # kg m^2, motor and empty reel
    paper: float  # kg/m^2, pi/2 rho h
    m_c: float  # kg, capstan at the tape
    R_c: float  # m
    R_min: float  # m
    R_max: float  # m
    c: float  # N/m
    k: float  # N s/m


def build(settings: ProcessGainSettings, dt: float) -> ProcessGainParams:
    """Nothing to discretise. Raises ValueError where the radii leave no range."""
    if settings.R_max <= settings.R_min:
        raise ValueError(f"R_max {settings.R_max:g} m is not above R_min {settings.R_min:g} m")
    return ProcessGainParams(
        torque_per_volt=settings.torque_per_volt,
        w=2 * pi * settings.frequency,
        J_reel=settings.J_m + settings.J_0,
        paper=pi / 2 * settings.rho * settings.h,
        m_c=settings.J_c / settings.R_c**2,
        R_c=settings.R_c,
        R_min=settings.R_min,
        R_max=settings.R_max,
        c=settings.c,
        k=settings.k,
    )


@tick
def clamp_radius(p, R):
    """Reel radius in m, `R` limited to the range of a reel."""
    return min(max(R, p.R_min), p.R_max)


@tick
def mass(p, R):
    """Mass in kg that a reel of radius `R` m puts at the tape, its motor included."""
    return (p.J_reel + p.paper * (R * R * R * R - p.R_min * p.R_min * p.R_min * p.R_min)) / (R * R)


@tick
def step(p, R_drive, R_other):
    """K_p in rad/s^2 per V on the motor of the reel with radius `R_drive` m, the other reel having `R_other` m."""
    R_drive = clamp_radius(p, R_drive)
    kappa = complex(p.c, p.w * p.k)
    m_drive = mass(p, R_drive)
    m_other = mass(p, clamp_radius(p, R_other))
    from_drive = kappa / (kappa - p.w * p.w * m_drive)
    from_other = kappa / (kappa - p.w * p.w * m_other)
    M = p.m_c + m_drive * from_drive + m_other * from_other
    return p.torque_per_volt / (R_drive * p.R_c) * abs(from_drive / M)
