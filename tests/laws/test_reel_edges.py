import numpy as np
import pytest

from rtctl.laws import reel_edges

ANGLE = 2 * np.pi / 209


def test_edges_give_the_radius_and_ignore_counts_before_the_start(zero):
    s = zero(reel_edges.EDGES_STATE)
    assert reel_edges.radius(s, 0.0125, ANGLE) == 0.0
    for k in range(400):
        phi = -0.005 * k
        n = int(abs(phi) * 0.0125 / 0.03 / ANGLE + 0.37)
        reel_edges.follow(
            s, phi, n + (17 if k > 100 else 0), int(k > 150)
        )  # offset of the counts before counting begins
    assert reel_edges.radius(s, 0.0125, ANGLE) == pytest.approx(0.03, rel=0.01)
    assert s.seen == s.n_b - s.n_a + 1
    reel_edges.clear(s)
    assert reel_edges.radius(s, 0.0125, ANGLE) == 0.0
