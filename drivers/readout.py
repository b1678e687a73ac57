"""Reading of a measuring device: a quantity with noise, rounded to the device's resolution.

Plant side: `codes` gives the nearest multiple of the resolution. Loop side: `value` gives the reading.

Source: Widrow & Kollar, Quantization Noise (2008), ch. 1.
"""

from typing import NamedTuple

import numpy as np

from rtctl.counted import mixed, nth
from rtctl.idiom import state, tick

LARGEST = float(2**31 - 1)  # largest code of the frame


class ReadoutParams(NamedTuple):
    scale: float  # column units per SI unit
    grain: float  # column units per code
    noise: float  # codes, standard deviation
    seed: int


READOUT_STATE = state(n=int)


def build(scale: float, grain: float, noise: float, seed: int) -> ReadoutParams:
    """Parameters of a device: `scale` in column units per SI unit, resolution `grain` and `noise` in column units."""
    return ReadoutParams(scale, grain, noise / grain, (seed * 0x2545F491 + 0x9E3779B1) & 0x7FFF_FFFF_FFFF_FFFF)


@tick
def codes(p, s, y):
    """Code for the quantity `y`, SI; 0 for NaN."""
    x = y * p.scale / p.grain
    if p.noise > 0.0:
        x += p.noise * normal(p.seed, s.n)
        s.n += 1
    if not abs(x) < LARGEST:
        return 0 if x != x else int(np.sign(x) * LARGEST)
    return int(np.rint(x))


@tick
def value(p, code):
    """Reading for a code, in column units."""
    return code * p.grain


@tick
def code(p, number):
    """Code for a reading in column units."""
    return int(np.rint(number / p.grain))


@tick
def normal(seed, n):
    """The n-th number of a nearly Gaussian sequence, mean 0, variance 1: sum of twelve uniforms."""
    total = 0.0
    for i in range(3):
        z = mixed(nth(seed, 3 * n + i))
        for _ in range(4):
            total += (float(z & np.uint64(0xFFFF)) + 0.5) / 65536.0
            z = z >> np.uint64(16)
    return total - 6.0
