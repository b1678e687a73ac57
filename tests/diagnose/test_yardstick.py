"""What sizes are measured by, where drives differ."""

import numpy as np
import pytest

from rtctl.diagnose.case import read_case
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.record import Record
from rtctl.diagnose.scales import Scales
from rtctl.diagnose.yardstick import LITTLE, Measures


@pytest.fixture
def of(case_of):
    """Measures of a reel unit whose drives have such commands."""

    def measures(*volts):
        case, zero = read_case(case_of("ivu"), "."), np.zeros(100)
        counts = dict.fromkeys(("capstan_counts", "reel1_counts", "reel2_counts"), zero)
        u = np.ones((100, 1)) * volts
        record = Record("ivu", case, 2e-3 * np.arange(100), 2e-3, zero, zero, u, counts, {})
        main = Scales(force=1.0, speed=1.0, span=1.0, low=0.1)
        return Measures(record, owner_model(case).base, {"sensor": main, "capstan": main}, {})

    return measures


def test_a_drive_is_measured_by_its_own_command(of):
    """Heat of one that hardly works, by the command of the other, makes a loss of some per cent one of twenty."""
    measures = of(0.1, 1.2)
    assert measures.of("volts", "drive1") == measures.of("volts", "motor1") == pytest.approx(0.1)
    assert measures.of("volts", "drive2") == pytest.approx(1.2)
    both = np.sqrt((0.1**2 + 1.2**2) / 2)
    assert measures.of("volts", "capstan") == pytest.approx(both)
    assert measures.of("per_volt", "drive1") == pytest.approx(1.0 / both)  # a supply feeds both


def test_one_that_does_nothing_has_a_measure_all_the_same(of):
    assert of(0.0, 1.0).of("volts", "drive1") == pytest.approx(LITTLE * np.sqrt(0.5))
