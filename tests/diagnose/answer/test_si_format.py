import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose.answer.si_format import both, nice, percent, span

SCALE = {"": 1, "m": 1e-3, "u": 1e-6, "n": 1e-9}


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0031, "Nm", "3.1 mNm"), (1.2e-6, "m", "1.2 um"), (-0.123, "V", "-120 mV"), (0.0012, "s", "1.2 ms"),
        (123.4, "Hz", "120 Hz"), (1.5e6, "N/m", "1.5 MN/m"), (0.9999, "V", "1.0 V"), (0.53, "rad/s", "0.53 rad/s"),
        (12.0, "counts", "12 counts"), (0.4, "counts", "0.40 counts"), (0.0, "Nm", "0 Nm"), (1500.0, "s", "1500 s"),
        (3e-12, "m", "0.0030 nm"), (0.25, "", "0.25"), (float("inf"), "V", "any size"), (float("nan"), "V", "unknown"),
    ],
)  # fmt: skip
def test_numbers_are_formatted_with_si_prefixes(value, unit, text):
    assert nice(value, unit) == text


@settings(deadline=None)
@given(st.floats(1e-9, 1e6), st.sampled_from(["Nm", "V", "s", "m"]))
def test_formatted_number_reads_back_within_its_precision(value, unit):
    number, shown = nice(value, unit, 3).split()
    prefix = shown.removesuffix(unit)
    assert float(number) * SCALE[prefix] == pytest.approx(value, rel=5.1e-3)


def test_two_sizes_are_formatted_to_their_difference():
    assert both(0.003124, 0.003081, "Nm") == ("3.12 mNm", "3.08 mNm")


def test_span_is_formatted_with_one_unit():
    assert span(-0.0047, 0.00024, "m") == "-4.7 to 0.24 mm"
    assert span(0.0, 3.0, "rad") == "0 to 3.0 rad"


def test_share_is_formatted_in_percent():
    assert percent(0.0344) == "3.4 %"
