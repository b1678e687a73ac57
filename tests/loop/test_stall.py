"""Stall of the loop: the plant moves on, missed periods count, and the trip precedes the outputs."""

from typing import Any

import numpy as np
import pytest

from rtctl.faults.cases import STANDS
from rtctl.faults.drives import Inside
from rtctl.tick import safety


def stalled(mode: str, size: float, **changes: Any) -> tuple[np.ndarray, int]:
    """Rows of the reel unit whose loop stalls for `size` s during a motion, and the tick of the stall."""
    stand = STANDS["ivu"]
    rate = stand.config().loop.rate
    fault = {"fault": "loop.stall", "at": stand.begin, "lasts": 1.0 / rate, "size": size}
    ticks = stand.ticks(stand.begin + 0.2)
    with Inside(stand.config([fault], loop__mode=mode, **changes), ticks) as drive:
        drive.to(ticks)
        return drive.rows().copy(), stand.ticks(stand.begin)


def test_stall_trips_in_its_tick_and_outputs_are_off_afterwards() -> None:
    rows, k = stalled("fused", 2.0)
    assert rows["trip"][k] == safety.MISSED and not rows["trip"][:k].any()
    assert rows["u1"][k - 1] > 0 and not rows["u1"][k:].any() and not rows["u2"][k:].any()
    assert rows["period"][k] == pytest.approx(2.002) and rows["t"][k] - rows["t"][k - 1] == pytest.approx(2.002)
    assert rows["truth_capstan"][k] - rows["truth_capstan"][k - 1] > 0.1  # the plant moved during the stall


@pytest.mark.parametrize(("periods", "trips"), [(8, False), (9, True), (10, True)])
def test_missed_tick_limit_counts_missed_periods_and_the_late_tick(periods: int, trips: bool) -> None:
    rows, k = stalled("fused", periods * 2e-3 + 1e-4, safety__missed_ticks=10)
    assert bool(rows["trip"][k] == safety.MISSED) is trips


def test_stall_in_lockstep_is_bit_exact_with_fused() -> None:
    fused, lockstep = stalled("fused", 0.01)[0], stalled("lockstep", 0.01)[0]
    assert all(np.array_equal(fused[n], lockstep[n], equal_nan=True) for n in fused.dtype.names)
    assert fused["t"][-1] == pytest.approx((len(fused) - 1 + 5) * 2e-3)


def test_missed_ticks_do_not_multiply_speed_and_derivative() -> None:
    """Eight missed ticks at 1.5 rad/s. The reference pauses, so that the command brakes; it must not jump to the limit,
    as it would where the motion of nine periods counted as that of one."""
    rows, k = stalled("fused", 8 * 2e-3 + 1e-4, safety__missed_ticks=20)
    assert not rows["trip"].any() and rows["period"][k] == pytest.approx(0.018)
    assert rows["capstan_speed"][k] == pytest.approx(rows["capstan_speed"][k - 1], rel=0.05)
    assert np.abs(rows["u_c"][k : k + 20]).max() < 4.0
