"""Force of the drives of a record, from their voltages.

Source: thesis 7.2 for A/V of the IVU, (12.3) for the amplifier of the LDU, N K_m / R_c for its gear.
"""

import numpy as np

from rtctl.drivers import ldu_amplifier
from rtctl.identify.records import Record
from rtctl.machines.profile import REELS
from rtctl.plants import ivu, ldu


def tape_force(record: Record) -> np.ndarray:
    """Force (n,) of the motors of an IVU along the tape in N, positive towards reel 1."""
    K = torque_per_volt(record)
    return K[0] * record["u1"] / record["R1"] - K[1] * record["u2"] / record["R2"]


def friction_force(record: Record) -> np.ndarray:
    """Friction (n,) in steady motion: Nm of a motor of an IVU with equal motors, V at the board of an LDU.

    For an LDU it is the voltage above the knee with equal current: the measured amplifier gives the same current at 0 V
    as at 0.8 V, in the direction of its bit.
    """
    if record.profile.has(REELS):
        return tape_force(record) / (1.0 / record["R1"] + 1.0 / record["R2"])
    u = record["u"]
    if record.config.amplifier.kind != "measured":
        return u
    return np.copysign(np.maximum(np.abs(u), ldu_amplifier.KNEE_VOLTS), u)  # -0.0 is 0 V backwards


def written_force(record: Record) -> np.ndarray:
    """`friction_force` (n,) with the written voltage of the board, without the knee."""
    return friction_force(record) if record.profile.has(REELS) else record["u"]


def newtons(record: Record, rows: slice) -> float:
    """Mean drive force in N over `rows`, along the tape or at the carriage."""
    force = tape_force(record) if record.profile.has(REELS) else carriage_force(record)
    return float(np.mean(force[rows]))


def torque_per_volt(record: Record) -> tuple[float, float]:
    """Nm/V of both motors of an IVU."""
    p, law = ivu.parameters(record.config.plant), record.config.law.tension
    return p.K_m1 * law.amp_per_volt, p.K_m2 * law.amp_per_volt


def carriage_force(record: Record) -> np.ndarray:
    """Force (n,) at the carriage of an LDU in N, by the amplifier characteristic of its config (12.3)."""
    p = ldu.parameters(record.config.plant)
    curve = ldu_amplifier.build(record.config.amplifier, 1.0)
    u = record["u"]
    volts, back = np.unique(np.abs(u), return_inverse=True)
    amperes = np.array([ldu_amplifier.current.py_func(curve, v, 1) for v in volts.tolist()])
    return np.copysign(amperes[back], u) * p.K_m1 * (p.R_t / p.R_s) / p.R_c
