"""Random numbers that are a function of a seed and a count, so that a run repeats to the bit and keeps no state.

Source: splitmix64, Steele, Lea & Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
"""

import numpy as np

from rtctl.idiom import tick

STEP = np.uint64(0x9E3779B97F4A7C15)


@tick
def mixed(z):
    """All bits of the 64-bit `z` stirred into each other."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@tick
def uniform(z):
    """A number in (0, 1), evenly spread over the values of the 64-bit `z`."""
    return (float(mixed(z) >> np.uint64(11)) + 0.5) * 2.0**-53


@tick
def nth(seed, n):
    """The 64-bit value whose `mixed` is the n-th of the sequence of `seed`."""
    return np.uint64(seed) + np.uint64(n + 1) * STEP
