"""Linear axis of one mass against closed-form motions."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.idiom import tick
from rtctl.plants import axis, linear
from rtctl.plants.graph import plant as graph

M, F_V, F_C = 95.1, 203.5, 20.4


def plant(h: float = 1e-3, **parameters: float) -> Any:
    p = axis.build(axis.AxisSettings(parameters=parameters), h)
    s = np.zeros(1, axis.AXIS_STATE).view(np.recarray)[0]
    graph.start(p.graph, s)
    return s


@tick
def run(s, n):
    for _ in range(n):
        linear.midpoint(s.m)
        linear.advance(s.m)


def test_viscous_friction_gives_an_exponential_speed_decay():
    s = plant(F_c=0.0)
    s.m.x[1] = 0.5
    run(s, 1000)
    fall = math.exp(-F_V / M)
    np.testing.assert_allclose(s.m.x[:2], [0.5 * M / F_V * (1 - fall), 0.5 * fall], rtol=1e-10)


def test_spring_has_its_natural_frequency_and_conserves_energy():
    k = 4e4
    w = math.sqrt(k / M)
    s = plant(h=1e-3, F_c=0.0, F_v=0.0, k=k)
    s.m.x[0] = 0.01
    run(s, 5000)
    np.testing.assert_allclose(s.m.x[:2], [0.01 * math.cos(5 * w), -0.01 * w * math.sin(5 * w)], atol=1e-9)
    assert 0.5 * k * s.m.x[0] ** 2 + 0.5 * M * s.m.x[1] ** 2 == pytest.approx(0.5 * k * 1e-4, rel=1e-9)


@settings(deadline=None, max_examples=20)
@given(st.floats(0.05, 1.0), st.sampled_from([-1, 1]))
def test_coasting_distance_under_dry_and_viscous_friction(speed, sign):
    """M v v' = -F_v v - F_c: x = M/F_v (v - F_c/F_v ln(1 + F_v v / F_c))."""
    s = plant()
    s.m.x[1] = sign * speed
    run(s, 5000)
    wanted = M / F_V * (speed - F_C / F_V * math.log(1 + F_V * speed / F_C))
    assert abs(s.m.x[1]) < 1e-15
    assert s.m.x[0] * sign == pytest.approx(wanted, abs=2e-7)


def test_constant_voltage_gives_the_speed_of_the_force_balance():
    s = plant()
    s.m.u[0] = 5.0
    run(s, 10_000)
    assert s.m.x[1] == pytest.approx((35.15 * 5.0 - F_C) / F_V, rel=1e-6)


@pytest.mark.parametrize(("volts", "moves"), [(0.57, False), (0.59, True)])
def test_axis_breaks_away_above_the_dry_friction(volts, moves):
    s = plant()
    s.m.u[0] = volts
    run(s, 1000)
    assert (s.m.x[0] > 1e-6) == moves
    if not moves:
        assert s.m.x[0] == pytest.approx(0.0, abs=1e-15)


def test_state_space_matrices_of_the_axis_without_dry_friction():
    p = axis.build(axis.AxisSettings(parameters={"k": 100.0}), 1e-3)
    A, B = axis.state_space(p)
    np.testing.assert_allclose(A, [[0.0, 1.0], [-100 / M, -F_V / M]])
    np.testing.assert_allclose(B, [[0.0], [35.15 / M]])
