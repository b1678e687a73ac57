"""Exact free response of a second-order system over a step, at any damping.

    e' = d,  d' = -e - 2 zeta d        in units of its own time

Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), 2.3.
"""

import math

from rtctl.idiom import tick

CRITICAL = 1e-6  # of the damped frequency, below which it is critically damped


@tick
def transition(x, zeta):
    """Matrix of a step of x (time over the system's own), row by row: (e to e, d to e, e to d, d to d)."""
    w = math.sqrt(abs(1.0 - zeta * zeta))
    if w < CRITICAL:
        C = math.exp(-zeta * x)
        S = x * C
    elif zeta < 1.0:
        fade = math.exp(-zeta * x)
        C, S = fade * math.cos(w * x), fade * math.sin(w * x) / w
    else:
        slow, fast = math.exp(-(zeta - w) * x), math.exp(-(zeta + w) * x)
        C, S = 0.5 * (slow + fast), 0.5 * (slow - fast) / w
    return C + zeta * S, S, -S, C - zeta * S
