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
    """Measures of a reel unit whose drives have such commands, and of which its owner says so much more."""

    def measures(*volts, **drive):
        given = case_of("ivu")
        case, zero = read_case({**given, "drive": {**given["drive"], **drive}}, "."), np.zeros(100)
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


def test_what_the_owner_s_bandwidth_of_a_driver_is_off_by_may_look_like_a_delay(of):
    """Of a second-order low pass: 2 zeta / w, by the owner's tolerance of 15 %."""
    assert of(1.0, 1.0).of("driver", "loop") == 0.0  # the owner says nothing of it
    measures = of(1.0, 1.0, bandwidth_hz=3000.0, damping=0.7)
    assert measures.of("driver", "loop") == pytest.approx(0.15 * 2 * 0.7 / (2 * np.pi * 3000.0))
