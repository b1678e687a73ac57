import numpy as np

from rtctl.diagnose.answer import figure_style as figures


def test_thinning_keeps_peaks():
    y = np.zeros(100_000)
    y[51_234] = 7.0
    t, thinned = figures.thin(np.arange(len(y)), y)
    assert len(t) == len(thinned) < 3 * figures.POINTS and thinned.max() == 7.0
