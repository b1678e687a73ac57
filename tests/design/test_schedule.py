import fused
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.design import margins, robustness, schedule


@pytest.fixture(scope="module")
def found() -> schedule.Schedule:
    return schedule.design(fused.config("ivu"), printed=True)


def test_schedule_keeps_six_decibels_at_every_radius(found):
    """Chapter 9: the fixed gain has 1.2 dB left at 40/40 mm."""
    assert found.fixed.worst[0] == pytest.approx(1.2, abs=0.15)
    assert found.scheduled.GM.min() >= 6.0
    assert found.scheduled.PM.min() >= 45.0
    assert found.scheduled.stable.all()


@pytest.mark.parametrize("motor", [1, 2])
@pytest.mark.parametrize(("R_drive", "R_other"), [(0.0388, 0.0388), (0.0213, 0.0392), (0.0365, 0.0211)])
def test_schedule_keeps_the_margins_between_nodes_and_for_both_motors(found, R_drive, R_other, motor):
    config = schedule.with_table(fused.config("ivu"), found.table)
    m = robustness.at(config, R_drive, R_other, motor, printed=True)
    assert m.stable and m.GM >= 6.0 and m.PM > 44.0


def test_schedule_keeps_the_loop_gain_where_the_margin_allows(found):
    """At the radii of the design the factor is about 1."""
    config = schedule.with_table(fused.config("ivu"), found.table)
    plain, led = (robustness.at(c, 0.038, 0.022) for c in (fused.config("ivu"), config))
    assert plain.GM - led.GM == pytest.approx(0.0, abs=2.5)


def test_machine_runs_with_the_gain_schedule(found):
    """Full reels, where the fixed gain is nearly unstable."""
    config = schedule.with_table(robustness.with_radii(fused.config("ivu", "steps"), 0.04, 0.04), found.table)
    run = fused.run(config, 6.0)
    assert not run.tripped
    rows = run.between(0.0, 4.0)
    assert 0.3 < rows["gain_factor"].mean() < 0.7
    assert abs(rows["truth_capstan"][-1] - rows["target"][-1]) < 0.015


def test_unreachable_margins_have_no_schedule():
    with pytest.raises(NoAnswer, match="no factor keeps 6 dB and 89 deg"):
        schedule.design(fused.config("ivu"), PM=89.0, radii=(0.02, 0.04))


def test_gain_factor_is_the_nearest_that_keeps_both_margins():
    f = np.geomspace(0.05, 200, 2000)
    s = 2j * np.pi * f
    L = 60 * (1 + 0.1 * s) / s**2 * np.exp(-3e-3 * s)
    k = schedule._factor(f, L, 80.0, 80.0, np.array([6.0, 5.0]))
    assert margins.points(f, k * L).GM == pytest.approx(6.0, abs=0.2)
    assert schedule._factor(f, L, 1.0, 2.0, np.array([6.0, 30.0])) == 1.0
