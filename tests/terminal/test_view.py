"""Plain lines for pipes, and display quantities by names and units."""

import pytest

from rtctl.terminal.view import number, plain, quantities


def test_plain_line_has_no_control_characters(picture):
    line = plain(picture.status, picture.traces.units, left=3.0)
    assert line.isprintable()
    assert "running" in line and "missed 0" in line and line.endswith("3 s left")
    trip = {"code": "tension", "why": "torn", "tick": 4}
    assert "tension at tick 4: torn" in plain({**picture.status, "trip": trip}, picture.traces.units)


def test_tension_has_the_reference_of_the_law(picture):
    found = {q.label: q for q in quantities(picture.status["signals"], picture.traces.units, picture.law)}
    if "capstan" not in found:
        assert found["position"].unit == "mm"
        assert found["u"].limits == (-3.0, 3.0)
        return
    assert found["tension 1"].reference == picture.law["tension"]["F_t"]
    assert found["u2"].limits == (-10.0, 10.0)


def test_output_limits_may_be_asymmetric():
    law = {"limit": {"high": 5.0, "low": -1.0}}
    assert quantities({"u": 0.0}, {"u": "V"}, law)[0].limits == (-1.0, 5.0)
    assert quantities({"u": 0.0}, {"u": "V"}, {})[0].limits is None


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(1.23456, "V", "+1.235"), (-1e7, "V", "-1.000e+07"), (None, "V", ""), (float("nan"), "mm", "+nan")],
)
def test_number_format(value, unit, text):
    assert number(value, unit) == text
