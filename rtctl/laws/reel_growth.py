"""Radii of two reels that exchange a tape, from the angle of the capstan.

    R^2 = R_0^2 + d_tape x / pi                  x = R_c (phi - phi_0), the tape that the reel has wound

A reel without paper has the radius of its core.

Source: thesis (4.3)-(4.6).
"""

from typing import NamedTuple

import numpy as np

from rtctl.idiom import state, tick


class ReelGrowthParams(NamedTuple):
    grow: float  # d_tape R_c / pi: R^2 grows by this per rad of capstan
    core: float  # m, radius of a reel without tape


REEL_GROWTH_STATE = state(R1=float, R2=float, R1_0=float, R2_0=float, phi_0=float)  # m; capstan angle of R_0, rad


@tick
def start(s, R1, R2, phi):
    """The radii are `R1` and `R2`, m, at the capstan angle `phi` rad."""
    s.R1_0, s.R2_0, s.phi_0 = R1, R2, phi


@tick
def step(p, s, phi):
    """Write s.R1 and s.R2, the radii in m at the capstan angle `phi` rad."""
    s.R1 = grown(s.R1_0, p.grow * (phi - s.phi_0), p.core)
    s.R2 = grown(s.R2_0, -p.grow * (phi - s.phi_0), p.core)


@tick
def grown(R_0, area, core):
    """Radius in m of a reel of `R_0` m whose paper has grown by `area` pi m^2, and at least that of the `core`."""
    least = min(core, R_0) if R_0 > 0.0 else core  # no radius is known before the first arming
    return np.sqrt(max(R_0 * R_0 + area, least * least))
