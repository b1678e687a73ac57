import contextlib
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.units import convert, to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("160 ms", "s", 0.16),
        ("5 um", "m", 5e-6),
        ("5µm", "m", 5e-6),
        ("2.4 mNm", "Nm", 2.4e-3),
        ("3 Nm s/rad", "Nms/rad", 3.0),
        ("2 g cm^2", "kg*m^2", 2e-7),
        ("50 %", "", 0.5),
        ("1e3", "Hz", 1000.0),
        ("1.5kHz", "Hz", 1500.0),
        ("3 kΩ", "ohm", 3000.0),
        ("243 V*s/m", "V*s/m", 243.0),
        ("90 deg", "rad", math.pi / 2),
        (5, "m", 5),
        (None, "m", None),
    ],
)
def test_common_spellings_of_quantities_are_read(text, unit, value):
    assert to_si(text, unit) == (None if value is None else pytest.approx(value, rel=1e-15))


def test_hertz_is_one_turn_per_second():
    assert to_si("8 Hz", "rad/s") == pytest.approx(16 * math.pi)
    assert to_si("300 rpm", "Hz") == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("500 mm", "Hz", "'500 mm' is not a quantity in Hz"),
        ("31 V", "V/rad", "'31 V' is not a quantity in V/rad"),
        ("3 furlongs", "m", "'furlongs' is not a unit"),
        ("fast", "m/s", "'fast' is not a number with a unit; write e.g. '1.5 m/s'"),
        ("nan", "m", "not a number"),
        ("1 m**9**9**9", "m", "not a unit"),
        ("1 __import__('os')", "m", "not a unit"),
        (True, "m", "true is not a number"),
    ],
)
def test_invalid_quantity_gives_an_error_message(text, unit, message):
    with pytest.raises(ValueError, match=message.replace("*", r"\*").replace("(", r"\(").replace(")", r"\)")):
        to_si(text, unit)


@settings(deadline=None)
@given(st.text(max_size=60), st.sampled_from(["", "m", "Hz", "Nm/rad", "kg*m^2"]))
def test_any_text_is_a_number_or_a_value_error(text, unit):
    for value in (text, f"1 {text}"):
        with contextlib.suppress(ValueError):
            assert isinstance(to_si(value, unit), float)


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.sampled_from([("mm", "m"), ("rpm", "Hz"), ("mNm", "Nm"), ("deg", "rad")]))
def test_unit_conversion_is_invertible(value, units):
    there, back = units
    assert convert(convert(value, there, back), back, there) == pytest.approx(value, rel=1e-12, abs=1e-300)


def test_error_message_for_a_value_is_one_line():
    with pytest.raises(ValueError) as told:
        to_si("\x85", "V")
    assert len(str(told.value).splitlines()) == 1
