import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import friction_feedforward as ff

P = ff.build(ff.FrictionFeedforwardSettings(tau_C="2.4 mNm"), 0.002)
VOLTS = 2.4e-3 / (0.061 * 0.2)


def run(s, references):
    return [ff.step(P, s, float(r)) for r in references]


def test_feedforward_is_zero_until_the_reference_moves_then_holds_its_sign(zero):
    s = zero(ff.FRICTION_FEEDFORWARD_STATE)
    wanted = [0, 0, VOLTS, VOLTS, -VOLTS, -VOLTS, VOLTS]
    assert run(s, [5.0, 5.0, 6.0, 6.0, 5.5, 5.5, 5.6]) == pytest.approx(wanted)
    ff.reset(P, s)
    assert run(s, [-1.0, -1.0]) == [0.0, 0.0]


@settings(deadline=None)
@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=20))
def test_feedforward_has_the_sign_of_the_last_reference_change(references):
    last = next((np.sign(b - a) for a, b in zip(references[-2::-1], references[:0:-1], strict=True) if a != b), 0.0)
    assert run(np.zeros(1, ff.FRICTION_FEEDFORWARD_STATE)[0], references)[-1] == pytest.approx(last * VOLTS)


def test_exchange_format_variant_is_zero_at_rest(zero):
    s = zero(ff.FRICTION_FEEDFORWARD_STATE)
    p = ff.FrictionFeedforwardParams(0.25, held=0)
    assert [ff.step(p, s, ref) for ref in (0.0, 1.0, 1.0, 0.5)] == [0.0, 0.25, 0.0, -0.25]
