import numpy as np
import pytest

from rtctl.diagnose.answer import page as report
from rtctl.diagnose.evidence.diagnosis import Interval


@pytest.mark.parametrize(
    ("v", "unit", "text"),
    [
        (Interval(0.0031, 0.003, 0.0032), "Nm", ("3.10 mNm", "3.00 to 3.20")),
        (Interval(0.2, -0.3, 0.7), "", ("0.20", "-0.30 to 0.70")),
        (Interval(1.0, 0.5, np.inf), "V", ("1.0 V", "0.50 to -")),
    ],
)
def test_intervals_share_a_unit(v, unit, text):
    assert report.interval(v, unit) == text
