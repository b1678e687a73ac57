"""Measurement of the reel radii on a rigid tape with dry friction: m v' = tau1/R1 - tau2/R2 - friction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import reel_radius
from rtctl.laws.process_gain import ProcessGainSettings, mass
from rtctl.laws.process_gain import build as build_process

DT = 0.002
R_C = 0.0125
COUNT = 2 * np.pi / 10_000
PROCESS = build_process(ProcessGainSettings(), DT)


def built(**choices):
    return reel_radius.build(reel_radius.ReelRadiusSettings(**choices), DT)


P = built()


class Unit:
    """Two reels, a rigid tape and a capstan; `offsets` are the initial phases of the reel sensors, in counts."""

    def __init__(self, R1, R2, offsets=(0.3, 0.6), stuck=False, dead=False):
        self.R = np.array([R1, R2])
        self.m = mass(PROCESS, R1) + mass(PROCESS, R2) + PROCESS.m_c
        self.dry = 0.0 if not stuck else 1e3
        self.dry += 2.4e-3 * (1 / R1 + 1 / R2)
        self.x = self.v = self.way = 0.0
        self.offsets, self.dead = np.array(offsets), dead

    def read(self):
        turned = self.way / self.R * 209 / (2 * np.pi)
        counts = np.floor(turned + self.offsets) * (not self.dead)
        return np.floor(self.x / R_C / COUNT) * COUNT, int(counts[0]), int(counts[1])

    def advance(self, u1, u2):
        force = 0.0122 * (u1 / self.R[0] - u2 / self.R[1])
        v = self.v + force * DT / self.m
        self.v = float(np.sign(v) * max(abs(v) - self.dry * DT / self.m, 0.0))
        self.x += self.v * DT
        self.way += abs(self.v) * DT


def radii(s):
    return s.R1, s.R2


def run(p, unit, limit=20_000):
    s = np.zeros(1, reel_radius.REEL_RADIUS_STATE).view(np.recarray)[0]
    trace = []
    for _ in range(limit):
        done = reel_radius.step(p, s, *unit.read())
        trace.append((s.u1, s.u2, unit.v, unit.x))
        if done:
            break
        unit.advance(s.u1, s.u2)
    assert done
    return s, np.array(trace)


@settings(deadline=None, max_examples=8)
@given(st.floats(0.02, 0.04), st.floats(0.02, 0.04), st.floats(0, 1), st.floats(0, 1))
def test_radius_measurement_is_accurate_to_one_percent(R1, R2, offset1, offset2):
    s, _ = run(P, Unit(R1, R2, (offset1, offset2)))
    assert s.failed == 0
    assert radii(s) == pytest.approx((R1, R2), rel=0.01)


@pytest.mark.parametrize(("R1", "R2"), [(0.04, 0.02), (0.02, 0.04), (0.03, 0.03)])
def test_radius_measurement_is_smooth_and_ends_at_rest_under_tension(R1, R2):
    unit = Unit(R1, R2)
    s, trace = run(P, unit)
    u, v, x = trace[:, :2], trace[:, 2], trace[:, 3]
    assert np.abs(np.diff(u, axis=0)).max() < 0.05  # no jerk
    assert u[200:].min() > 0.1  # the tape is never slack
    assert np.abs(v).max() / R_C < 6.0
    assert np.all(v[-100:] == 0.0)
    assert x.min() / R_C < -1.9  # motor 2 pulls first, then motor 1 winds back
    assert abs(x[-1]) / R_C < 1.0
    assert (s.u1, s.u2) == pytest.approx((0.1 * R1 / 0.0122, 0.1 * R2 / 0.0122), rel=0.02)


def test_one_way_measurement_ends_without_moving_back():
    s, trace = run(built(both_ways=False), Unit(0.03, 0.025))
    assert (s.failed, s.run) == (0, 1)
    assert radii(s) == pytest.approx((0.03, 0.025), rel=0.01)
    assert trace[-1, 3] / R_C < -1.9


@pytest.mark.parametrize("trouble", ["stuck", "dead"])
def test_radius_measurement_fails_at_the_timeout_with_the_drive_off(trouble):
    p = built(timeout=3.0)
    s, trace = run(p, Unit(0.03, 0.03, **{trouble: True}))
    assert s.failed == 1
    assert s.drive == 0.0
    assert trace[:, :2].max() < p.T_max + p.u_step + 1.0


def test_double_counts_of_a_sensor_fail_the_measurement():
    unit = Unit(0.03, 0.03)
    honest = unit.read
    unit.read = lambda: (honest()[0], 2 * honest()[1], honest()[2])
    s, _ = run(P, unit)
    assert s.failed == 1


def test_edge_count_restarts_when_the_tape_runs_back(zero):
    s = zero(reel_radius.REEL_RADIUS_STATE)
    s.phase, s.direction = reel_radius.PULL, -1.0
    phi = np.concatenate([-0.004 * np.arange(100), -0.4 + 0.004 * np.arange(10)])
    for k, angle in enumerate(phi):
        reel_radius.step(P, s, angle, k // 8, k // 5)
    assert s.far == 0.0
    assert s.reel1.seen == s.reel2.seen == 0


def test_radius_measurement_can_be_repeated():
    unit = Unit(0.035, 0.025)
    s, _ = run(P, unit)
    reel_radius.reset(P, s)
    assert reel_radius.step(P, s, *unit.read()) == 0
    for _ in range(20_000):
        if reel_radius.step(P, s, *unit.read()):
            break
        unit.advance(s.u1, s.u2)
    assert s.failed == 0
    assert radii(s) == pytest.approx((0.035, 0.025), rel=0.01)


def test_travel_too_short_for_its_counts_is_refused():
    with pytest.raises(ValueError, match=r"by 1\.0 counts; take 0\.38 rad or more"):
        built(travel=0.1)
