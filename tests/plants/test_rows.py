"""The sum in vector registers is bit-identical to the plain loop."""

import numpy as np
import pytest

from rtctl.idiom import tick
from rtctl.plants.rows import LANES, sum_rows


@tick
def compiled(out, n, P, x, nx, G, u, nu, f, nf):
    sum_rows(out, n, P, x, nx, G, u, nu, f, nf)


@pytest.mark.parametrize(("n", "nu", "nf"), [(2, 1, 1), (10, 1, 4), (14, 2, 5), (16, 0, 0), (17, 4, 7), (36, 4, 12)])
def test_vectorised_sum_is_bit_identical_to_the_plain_loop(n, nu, nf):
    rng, width = np.random.default_rng(n), 3 * LANES
    P, G = rng.normal(size=(width, width)), rng.normal(size=(nu + nf + 1, width)) * 1e3
    x, u, f = rng.normal(size=width), rng.normal(size=nu + 1), rng.normal(size=nf + 1)
    out, plain = np.full(width, np.nan), np.full(width, np.nan)
    compiled(out, n, P, x, n, G, u, nu, f, nf)
    sum_rows(plain, n, P, x, n, G, u, nu, f, nf)
    assert np.array_equal(out[:n], plain[:n])
    filled = -(-n // LANES) * LANES
    assert np.isnan(out[filled:]).all()  # nothing is written beyond the last register
