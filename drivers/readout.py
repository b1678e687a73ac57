"""Number of a measuring device: a quantity rounded to the device's resolution, with its noise.

Plant side: `codes` gives the nearest multiple of the resolution. Loop side: `value` gives the number back.

Source: Widrow & Kollar, Quantization Noise (2008), ch. 1.
"""

from typing import NamedTuple

import numpy as np

from rtctl.counted import mixed, nth
from rtctl.idiom import state, tick

LARGEST = float(2**31 - 1)  # code of the frame


class ReadoutParams(NamedTuple):
    scale: float  # column units for one SI unit
    grain: float  # column units for one code
    noise: float  # codes, standard deviation
    seed: int


READOUT_STATE = state(n=int)


def build(scale: float, grain: float, noise: float, seed: int) -> ReadoutParams:
    """Params of a device of `scale` column units for one SI unit, resolution `grain` and `noise`, both column units."""
    return ReadoutParams(scale, grain, noise / grain, (seed * 0x2545F491 + 0x9E3779B1) & 0x7FFF_FFFF_FFFF_FFFF)


@tick
def codes(p, s, y):
    """Code for the quantity `y`, SI; 0 for what is not a number."""
    x = y * p.scale / p.grain
    if p.noise > 0.0:
        x += p.noise * normal(p.seed, s.n)
        s.n += 1
    if not abs(x) < LARGEST:
        return 0 if x != x else int(np.sign(x) * LARGEST)
    return int(np.rint(x))


@tick
def value(p, code):
    """Number in the column for a code."""
    return code * p.grain


@tick
def code(p, number):
    """Code of a number in the column."""
    return int(np.rint(number / p.grain))


@tick
def normal(seed, n):
    """The n-th of a sequence of mean 0 and variance 1: twelve uniforms summed."""
    total = 0.0
    for i in range(3):
        z = mixed(nth(seed, 3 * n + i))
        for _ in range(4):
            total += (float(z & np.uint64(0xFFFF)) + 0.5) / 65536.0
            z = z >> np.uint64(16)
    return total - 6.0
