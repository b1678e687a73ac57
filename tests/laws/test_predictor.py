import numpy as np
import pytest

from rtctl.laws import predictor

DT, K, N = 0.001, 80.0, 12
P = predictor.build(predictor.PredictorSettings(delay=N, acceleration=K), DT)


def test_predictor_gives_the_position_at_which_the_present_command_acts():
    rng = np.random.default_rng(3)
    s = np.zeros(1, predictor.PREDICTOR_STATE)[0]
    x, v, way, told = 0.2, -0.4, [0.0] * N, []
    seen = []
    for u in rng.normal(size=100):
        told.append(predictor.step(P, s, x, v))
        seen.append(x)
        predictor.track(P, s, u)
        way.append(u)
        a = K * way.pop(0)
        x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
    np.testing.assert_allclose(told[:-N], seen[N:], atol=1e-12)


def test_predictor_stabilises_a_loop_with_a_delay():
    def most(predicts):
        s = np.zeros(1, predictor.PREDICTOR_STATE)[0]
        x, v, way, last = 1.0, 0.0, [0.0] * N, []
        for _ in range(3000):
            y = predictor.step(P, s, x, v) if predicts else x
            u = max(min(-60.0 * y - 0.9 * v, 1e6), -1e6)
            predictor.track(P, s, u)
            way.append(u)
            a = K * way.pop(0)
            x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
            last.append(abs(x))
        return max(last[-500:])

    assert most(predicts=True) < 1e-3
    assert most(predicts=False) > 1e3


def test_reset_clears_the_commands_in_transit():
    s = np.zeros(1, predictor.PREDICTOR_STATE)[0]
    predictor.track(P, s, 5.0)
    predictor.reset(P, s)
    assert predictor.step(P, s, 0.3, 0.0) == pytest.approx(0.3)
