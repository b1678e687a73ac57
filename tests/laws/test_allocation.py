import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import allocation

T1, T2 = 0.3, 0.2
KINDS = ["pull", "differential", "motor1", "motor2"]


def built(kind, **floor):
    return allocation.build(allocation.AllocationSettings(kind=kind, **floor), 0.002)


BARE = {kind: built(kind) for kind in KINDS}
FLOORED = {kind: built(kind, floor=0.5) for kind in KINDS}


def shared(p, u_c, T1=T1, T2=T2):
    s = np.zeros(1, allocation.ALLOCATION_STATE)[0]
    allocation.step(p, s, u_c, T1, T2)
    return s["u1"], s["u2"]


@pytest.mark.parametrize(
    ("kind", "u_c", "wanted"),
    [
        ("pull", 1.0, (1.3, 0.2)),
        ("pull", -1.0, (0.3, 1.2)),
        ("differential", 1.0, (0.8, -0.3)),
        ("differential", -1.0, (-0.2, 0.7)),
        ("motor1", -1.0, (-0.7, 0.2)),
        ("motor2", 1.0, (0.3, -0.8)),
    ],
)
def test_allocation_kind_selects_the_motors_that_carry_the_command(kind, u_c, wanted):
    assert shared(BARE[kind], u_c) == pytest.approx(wanted)


@pytest.mark.parametrize("kind", KINDS)
def test_zero_command_gives_the_tension_voltages(kind):
    assert shared(BARE[kind], 0.0) == shared(FLOORED[kind], 0.0) == (T1, T2)


@settings(deadline=None)
@given(st.floats(-10, 10))
def test_pull_never_lowers_the_tension_and_carries_the_whole_command(u_c):
    u1, u2 = shared(BARE["pull"], u_c)
    assert u1 >= T1 and u2 >= T2
    assert (u1 - T1) - (u2 - T2) == pytest.approx(u_c, abs=1e-12)


@settings(deadline=None)
@given(st.sampled_from(KINDS), st.floats(-10, 10))
def test_floor_keeps_both_tapes_taut_and_adds_equal_tension(kind, u_c):
    u1, u2 = shared(FLOORED[kind], u_c)
    bare1, bare2 = shared(BARE[kind], u_c)
    assert u1 >= 0.5 * T1 - 1e-9 and u2 >= 0.5 * T2 - 1e-9
    assert (u1 - bare1) / T1 == pytest.approx((u2 - bare2) / T2, abs=1e-9)  # same force on both sides of the capstan


@pytest.mark.parametrize("kind", KINDS)
def test_floor_without_tension_gives_finite_outputs(kind):
    assert np.all(np.isfinite(shared(FLOORED[kind], 1.0, 0.0, 0.0)))
