import numpy as np
import pytest

from rtctl.laws import reel_growth
from rtctl.laws.reel_growth import ReelGrowthParams

P = ReelGrowthParams(grow=0.5e-3 * 0.0125 / np.pi, core=0.01)


def test_one_reel_winds_the_tape_paid_out_by_the_other(zero):
    s = zero(reel_growth.REEL_GROWTH_STATE)
    reel_growth.start(s, 0.038, 0.022, 2.0)
    reel_growth.step(P, s, 2.0)
    assert (s.R1, s.R2) == pytest.approx((0.038, 0.022))
    reel_growth.step(P, s, 102.0)
    tape = 100.0 * 0.0125
    assert np.pi * (s.R1**2 - 0.038**2) == pytest.approx(tape * 0.5e-3)
    assert np.pi * (0.022**2 - s.R2**2) == pytest.approx(tape * 0.5e-3)


def test_empty_reel_has_the_radius_of_its_core(zero):
    s = zero(reel_growth.REEL_GROWTH_STATE)
    reel_growth.start(s, 0.038, 0.022, 0.0)
    reel_growth.step(P, s, 1e4)
    assert s.R2 == 0.01
