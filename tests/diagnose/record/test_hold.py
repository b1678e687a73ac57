import numpy as np
import pytest

from rtctl.diagnose.record.hold import half_a_tick_on


def test_half_a_tick_advance_of_a_slow_tone():
    k = np.arange(1000)
    told = half_a_tick_on(np.sin(2 * np.pi * 0.01 * k)[:, None])[:, 0]
    gain = np.sinc(0.01) ** 2 / np.cos(np.pi * 0.01)
    assert told == pytest.approx(gain * np.sin(2 * np.pi * 0.01 * (k + 0.5)), abs=1e-9)
