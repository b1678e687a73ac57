"""The recorded machine's own law, so that a simulation can close the loop as the machine did.

    ivu   e = ref - capstan angle;  d += a ((e - e_prev)/Ts - d),  a = 1 - exp(-2 pi f Ts)
          uc = P e + D d + friction sign(ref step) + w,  shared out between two motors with a constant pull on each
    ldu   e = ref - R_c encoder angle, through biquads in order;  u = y + w
    axis  u = kp kv (ref - x) - kv v + w,  v the backward difference of the two-tap mean of x

Each clips and rounds to the steps of the DAC where it has one.

Source: the `notes` of the exchange format's case.json; Janot, Gautier & Brunot 2019 for the cascade.
"""

from typing import NamedTuple

import numpy as np

from rtctl.idiom import state, tick

NONE, PD, SECTIONS, CASCADE = range(4)
ALLOCATIONS = ("pull", "differential", "motor1", "motor2")
MAX_SECTIONS = 8


class LawParams(NamedTuple):
    kind: int
    Ts: float  # s
    to_unit: float  # from the sensor's count (or metre) to the reference's unit
    limit: float  # V
    lsb: float  # V, step of the DAC; 0 for none
    top: float  # V, its highest
    P: float  # V/rad
    D: float  # V s/rad
    a: float  # share by which the derivative filter follows in a tick
    pull1: float  # V, constant pull of each motor
    pull2: float
    friction: float  # V, in the direction of the reference's step
    allocation: int
    kp: float  # 1/s
    kv: float  # V s/m
    n_sections: int
    sections: np.ndarray  # (8, 5) b0 b1 b2 a1 a2


LAW_STATE = state(started=int, ref=float, e=float, d=float, x1=float, x2=float, z=(float, (MAX_SECTIONS, 4)))


@tick
def step(p, s, ref, w, reading, volts):
    """Write the voltages of one tick into `volts`; `reading` is the main sensor's, in counts or metres."""
    x = reading * p.to_unit
    e = ref - x
    if s.started == 0:
        s.started = 1
        s.e, s.ref, s.x1, s.x2 = e, ref, x, x
    u = 0.0
    if p.kind == PD:
        s.d += p.a * ((e - s.e) / p.Ts - s.d)
        u = p.P * e + p.D * s.d + w
        if ref > s.ref:
            u += p.friction
        elif ref < s.ref:
            u -= p.friction
        if p.allocation == 0:
            volts[0] = p.pull1 + max(u, 0.0)
            volts[1] = p.pull2 + max(-u, 0.0)
        elif p.allocation == 1:
            volts[0] = p.pull1 + u / 2
            volts[1] = p.pull2 - u / 2
        elif p.allocation == 2:
            volts[0] = p.pull1 + u
            volts[1] = p.pull2
        else:
            volts[0] = p.pull1
            volts[1] = p.pull2 - u
    elif p.kind == SECTIONS:
        u = e
        for i in range(p.n_sections):
            z, c = s.z[i], p.sections[i]
            y = c[0] * u + c[1] * z[0] + c[2] * z[1] - c[3] * z[2] - c[4] * z[3]
            z[1], z[0] = z[0], u
            z[3], z[2] = z[2], y
            u = y
        volts[0] = u + w
    elif p.kind == CASCADE:
        v = (0.5 * (x + s.x1) - 0.5 * (s.x1 + s.x2)) / p.Ts
        volts[0] = p.kp * p.kv * e - p.kv * v + w
        s.x2, s.x1 = s.x1, x
    s.e, s.ref = e, ref
    for c in range(volts.shape[0]):
        volts[c] = min(max(volts[c], -p.limit), p.limit)
        if p.lsb > 0.0:
            volts[c] = min(np.floor(volts[c] / p.lsb + 0.5) * p.lsb, p.top)  # halves go up
