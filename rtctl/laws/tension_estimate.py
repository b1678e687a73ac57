"""Tape tensions in N from the motor voltages, less friction and inertia of the motors and reels.

    T_i = (K_m amp_per_volt u_i -+ tau_F sign(v) -+ J_i phi_i'') / R_i,   phi_i' = +- R_c v / R_i

each through a first-order low-pass, since one count of the encoder is worth half a newton. Upper signs for reel 1,
which winds when the capstan turns forward. The error is that of the friction; the estimate serves to trip on a torn or
folding tape, not for control.

Source: thesis (4.9)-(4.13), shafts taken as rigid.
"""

from math import exp, pi
from typing import NamedTuple

from rtctl.idiom import quantity, state, tick
from rtctl.laws.drive import DriveSettings


class TensionEstimateSettings(DriveSettings):
    J: float = quantity(1.5e-3, unit="kg*m^2", ge=0, help="inertia of a motor with its reel")
    tau_F: float = quantity(2.4e-3, unit="Nm", ge=0, help="dry friction of a motor")
    R_c: float = quantity(1.25e-2, unit="m", gt=0, help="radius of the capstan")
    filter: float = quantity(5.0, unit="Hz", gt=0, help="corner of the low-pass")
    v_min: float = quantity(0.05, unit="rad/s", gt=0, help="below this capstan speed friction may be either way")


class TensionEstimateParams(NamedTuple):
    torque_per_volt: float
    J: float
    tau_F: float
    R_c: float
    v_min: float
    a: float  # share of the new estimate that enters each tick


TENSION_ESTIMATE_STATE = state(T1=float, T2=float)


def build(settings: TensionEstimateSettings, dt: float) -> TensionEstimateParams:
    """Coefficients for a tick of `dt` s."""
    a = 1.0 - exp(-2 * pi * settings.filter * dt)
    return TensionEstimateParams(settings.torque_per_volt, settings.J, settings.tau_F, settings.R_c, settings.v_min, a)


@tick
def step(p, s, u1, u2, v, acceleration, R1, R2):
    """Write s.T1 and s.T2 in N from the voltages, the capstan's speed and acceleration (rad/s, rad/s^2), radii in m."""
    moving = min(max(v / p.v_min, -1.0), 1.0)
    turn1 = p.J * acceleration * p.R_c / R1
    turn2 = p.J * acceleration * p.R_c / R2
    s.T1 += p.a * ((p.torque_per_volt * u1 - p.tau_F * moving - turn1) / R1 - s.T1)
    s.T2 += p.a * ((p.torque_per_volt * u2 + p.tau_F * moving + turn2) / R2 - s.T2)
