from html.parser import HTMLParser

import numpy as np
import pytest

from rtctl.diagnose.answer import page as report
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Effect, Interval, LookAlike

VOID = {"meta", "br", "img", "hr", "link", "input"}
CASE = {
    "format": 1, "plant": "axis", "sample_rate": 500.0, "parameters": {"M": 2.0, "F_v": 4.0, "F_c": 1.0},
    "drive": {"newton_per_volt": 10.0, "limit_volt": 10.0}, "sensors": {"x_resolution_m": 1e-6}, "delay_samples": 0.0,
    "controller": {"kind": "none"}, "controller_known": False, "reaches": {"parameter_tolerance": 0.15},
}  # fmt: skip
STICKS = Effect(
    "friction.stribeck", "carriage", 0.9, {"F_s": Interval(2.0, 1.93, 2.07, "N"), "v_s": Interval(0.3, 0.28, 0.32)},
    (LookAlike("friction.load", "carriage", 0.012),),
)  # fmt: skip
DRAGS = Effect("friction.asymmetry", "carriage", 0.5, {"a": Interval(0.2, 0.1, 0.3)}, ())


class Strict(HTMLParser):
    """Parser that collects the errors and the content of a page."""

    def __init__(self):
        super().__init__()
        self.open, self.wrong, self.ids, self.words, self.tags = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


def parse(page: str) -> Strict:
    parser = Strict()
    parser.feed(page)
    parser.close()
    return parser


KINDS = [NAMED, "several", AMBIGUOUS, UNNAMED, NOTHING]


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
