"""Hand-over of friction compensation between the two motors of a tape.

    trail = min(|v| / trail_speed, 1)              share of the paying motor's friction that it compensates itself
    rest  = hand_over (1 - trail)                  share that the winding motor takes over
    u     = u_f1 + rest u_f2 R1 / R2               added to the command, reel 1 winding (with 1 and 2 exchanged: reel 2)

`v` is the speed of the capstan's reference. The paying motor gets trail u_f with the sign of its own motion.

Source: thesis 8.3 and 8.4.
"""

from typing import NamedTuple

from rtctl.idiom import state, tick


class HandOverParams(NamedTuple):
    trail_speed: float  # rad/s
    hand_over: float


HAND_OVER_STATE = state(u=float, u1=float, u2=float)  # V


@tick
def step(p, s, u_f1, u_f2, forward, v, R1, R2):
    """Write s.u, V to add to the command, and s.u1 and s.u2, V to add to the tension voltages.

    `u_f1` and `u_f2` are the friction voltages in V of the motors (see `friction_feedforward`), `forward` says whether
    reel 1 winds, `v` is the reference's speed in rad/s, radii are in m.
    """
    trail = min(abs(v) / p.trail_speed, 1.0)
    rest = p.hand_over * (1.0 - trail)
    s.u = u_f1 + rest * u_f2 * R1 / R2 if forward else u_f2 + rest * u_f1 * R2 / R1
    s.u1 = 0.0 if forward else trail * u_f1
    s.u2 = -(trail * u_f2) if forward else 0.0
