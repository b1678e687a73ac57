import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import bumpless, pd

DT = 0.002
P = bumpless.build(bumpless.BumplessSettings(), DT)


@settings(deadline=None)
@given(st.floats(-10, 10), st.floats(-10, 10))
def test_bumpless_transfer_has_no_jump_and_decays_to_the_new_output(before, after):
    s = np.zeros(1, bumpless.BUMPLESS_STATE)[0]
    assert bumpless.step(P, s, before, 0, before) == before
    u = [before, bumpless.step(P, s, after, 1, before)]
    assert u[1] == pytest.approx(before, abs=1e-12)
    u += [bumpless.step(P, s, after, 0, 0.0) for _ in range(500)]
    assert np.abs(np.diff(u)).max() <= abs(before - after) * (1 - P.decay) + 1e-12
    assert u[51] - after == pytest.approx((before - after) / np.e, abs=1e-9)  # after tau
    assert u[-1] == pytest.approx(after, abs=1e-3)


def test_gain_change_of_the_pd_law_is_bumpless(zero):
    low, high = (pd.build(pd.PdSettings(gain=g, tau_d=0.16), DT) for g in (3.0, 9.0))
    law, s = zero(pd.PD_STATE), zero(bumpless.BUMPLESS_STATE)
    u = []
    for k in range(200):
        wanted = pd.step(high if k >= 100 else low, law, 0.5)
        u.append(bumpless.step(P, s, wanted, int(k == 100), u[-1] if u else 0.0))
    assert np.abs(np.diff(u)).max() < 0.07
    assert u[99] == pytest.approx(1.5)


def test_reset_clears_the_transfer_offset(zero):
    s = zero(bumpless.BUMPLESS_STATE)
    bumpless.step(P, s, 1.0, 1, 5.0)
    bumpless.reset(P, s)
    assert bumpless.step(P, s, 1.0, 0, 0.0) == 1.0
