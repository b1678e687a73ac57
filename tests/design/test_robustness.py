import fused
import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.design import robustness


@pytest.mark.parametrize(("R1", "R2", "GM"), [(40, 40, 1.2), (40, 20, 3.7), (20, 20, 20.9), (38, 22, 5.2)])
def test_printed_law_is_stable_at_all_radii_with_small_margins(R1, R2, GM):
    """Erratum to 5.2 and 8.2: stable for all radii, but barely at 40/40."""
    m = robustness.at(fused.config("ivu"), R1 / 1e3, R2 / 1e3, printed=True)
    assert m.stable
    assert pytest.approx(GM, abs=0.15) == m.GM


def test_phase_margin_and_crossover_at_38_22():
    m = robustness.at(fused.config("ivu"), 0.038, 0.022, printed=True)
    assert pytest.approx(72, abs=0.5) == m.PM
    assert m.f_PM == pytest.approx(9.6, abs=0.1)


def test_margin_is_smallest_with_both_reels_full():
    found = robustness.over_radii(fused.config("ivu"), (0.02, 0.03, 0.04), (0.02, 0.04))
    assert found.GM.shape == (3, 2) and found.stable.all()
    assert found.worst[1:] == (0.04, 0.04)
    assert (np.diff(found.GM, axis=0) < 0).all()
    assert found.GM[2, 0] == pytest.approx(robustness.at(fused.config("ivu"), 0.04, 0.02).GM)


def test_margins_of_both_motors_are_equal():
    one, two = (robustness.at(fused.config("ivu"), 0.035, 0.025, motor) for motor in (1, 2))
    assert one.GM == pytest.approx(two.GM, rel=1e-6)


def test_linear_drive_has_no_radius_map():
    with pytest.raises(UserError, match="ldu has no reels"):
        robustness.with_radii(fused.config("ldu"), 0.03, 0.03)
