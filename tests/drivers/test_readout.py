"""Numeric readout of a sensor: rounding to a step, noise amplitude, and range."""

import numpy as np
import pytest

from rtctl.drivers import readout


def codes(p, values):
    s = np.zeros(1, readout.READOUT_STATE).view(np.recarray)[0]
    return np.array([readout.codes.interpret(p, s, y) for y in values])


def test_readout_is_rounded_to_the_nearest_step():
    p = readout.build(scale=1000.0, grain=0.5, noise=0.0, seed=1)  # mm in steps of 0.5 mm
    found = codes(p, [0.0, 0.0007, -0.0103])
    assert found.tolist() == [0, 1, -21]
    assert [readout.value.interpret(p, c) for c in found] == [0.0, 0.5, -10.5]
    assert [readout.code.interpret(p, v) for v in (0.5, -10.5)] == [1, -21]


def test_readout_noise_has_its_rms_and_repeats_with_its_seed():
    p = readout.build(scale=1.0, grain=0.1, noise=0.3, seed=7)
    y = codes(p, np.zeros(3000)) * 0.1
    assert y.std() == pytest.approx(0.3, rel=0.05) and abs(y.mean()) < 0.03
    assert np.array_equal(codes(p, np.zeros(50)), codes(p, np.zeros(50)))
    assert not np.array_equal(codes(p, np.zeros(50)), codes(p._replace(seed=8), np.zeros(50)))


@pytest.mark.parametrize(("y", "code"), [(np.nan, 0), (1e12, 2**31 - 1), (-1e12, 1 - 2**31), (np.inf, 2**31 - 1)])
def test_readout_out_of_range_is_clipped(y, code):
    assert codes(readout.build(1.0, 1e-3, 0.0, 1), [y])[0] == code
