"""Mean of the last two samples of a position, from which a cascade takes its speed.

    y[k] = (x[k] + x[k-1]) / 2

Source: Janot, Gautier & Brunot, Data set and reference models of EMPS (2019).
"""

from rtctl.idiom import state, tick

TWO_TAP_STATE = state(x=float, primed=int)  # the last sample, 1 once it is known


@tick
def step(s, x):
    """Mean in units of `x`. The first step after a start or a reset gives `x` itself."""
    if s.primed == 0:
        s.x = x
        s.primed = 1
    mean = 0.5 * (x + s.x)
    s.x = x
    return mean


@tick
def reset(s):
    """Forget the last sample."""
    s.primed = 0
